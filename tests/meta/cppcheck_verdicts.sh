#!/usr/bin/env bash
# tests/meta/cppcheck.py looks at a source again after each change that its verdict depends on, and only then; a finding is reported each time.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=verdict_checks.sh
source "$repository/tests/meta/verdict_checks.sh"
export PATH=$folder/bin:$PATH

# make_project NAME: the script in a repository of a header, a source that includes it through another one, and a source that does not.
make_project() {
  mkdir -p "$folder/$1"/{protocol,tests/ci,tests/meta}
  cd "$folder/$1"
  git init --quiet .
  cp "$repository/tests/meta/cppcheck.py" tests/meta/
  cp "$repository/tests/ci/verdicts.py" tests/ci/
  touch tests/meta/cppcheck.suppressions tests/meta/cppcheck.unreadable
  echo 'int one();' >protocol/one.hpp
  echo '#include "one.hpp"' >protocol/between.hpp
  printf '#include "protocol/between.hpp"\nint one() { return 1; }\n' >protocol/one.cpp
  echo 'int two() { return 2; }' >protocol/two.cpp
}

# Notes what it is asked to look at, finds what is wrong with the script's probe, and BAD in a source or in protocol/one.hpp.
mkdir "$folder/bin"
cat >"$folder/bin/cppcheck" <<'CPPCHECK'
#!/usr/bin/env bash
here=$(dirname "$0")
if [[ $1 == --version ]]; then cat "$here/version"; exit; fi
file=${*: -1}
if [[ $file == probe.cpp ]]; then echo "probe.cpp:3: error: out of bounds [arrayIndexOutOfBounds]"; exit; fi
echo "${file#protocol/}" >>"$here/../looked"
if grep -q CRASH "$file"; then kill -SEGV $$; fi
if grep -q BAD "$file" || { [[ $file == protocol/one.cpp ]] && grep -q BAD protocol/one.hpp; }; then echo "$file:1: warning: BAD [bad]"; fi
CPPCHECK
chmod +x "$folder/bin/cppcheck"
echo 'Cppcheck 2.10' >"$folder/bin/version"

look() {
  tests/meta/cppcheck.py "$@"
}

make_project first
expect "at first" "one.cpp two.cpp" 0
expect "nothing has changed" "" 0
expect "but asked to" "one.cpp two.cpp" 0 --again
expect "one that is known" "" 0 protocol/one.cpp
expect "that one, but asked to" "one.cpp" 0 --again protocol/one.cpp
make_project second
expect "the same in another folder" "" 0
echo '// more' >>protocol/one.hpp
expect "a header of a header" "one.cpp" 0
echo '// more' >>protocol/two.cpp
expect "a source" "two.cpp" 0
echo 'Cppcheck 2.11' >"$folder/bin/version"
expect "the version" "one.cpp two.cpp" 0
echo '# more' >>tests/meta/cppcheck.py
expect "the script" "one.cpp two.cpp" 0
echo '// BAD' >>protocol/one.hpp
expect "a finding" "one.cpp" 1
expect "the same again" "one.cpp" 1
grep -q 'BAD \[bad\]' "$folder/out" || fail "the finding is missing: $(cat "$folder/out")"
echo 'bad protocol/one.cpp it is a test' >tests/meta/cppcheck.suppressions
expect "a finding that is suppressed" "one.cpp" 0
expect "it has to be found each time, or the list could not say that it is not needed any more" "one.cpp" 0
sed -i '/BAD/d' protocol/one.hpp
expect "it is gone, and the list is too long" "" 1
: >tests/meta/cppcheck.suppressions
echo '// CRASH' >>protocol/two.cpp
expect "cppcheck crashes" "two.cpp" 1
expect "nothing is kept of that" "two.cpp" 1
echo '#include "missing.hpp"' >protocol/two.cpp
expect "what it includes is missing" "two.cpp" 0
echo 'int missing();' >protocol/missing.hpp
expect "what was missing is there" "two.cpp" 0
make_old
expect "what is asked for stays" "" 0
expect_kept 2
echo "as expected"
