#!/usr/bin/env bash
# tests/ci/tidy.py looks at a source again after each change that its verdict depends on, and only then; a finding is reported each time.
set -euo pipefail

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source-path=SCRIPTDIR source=verdict_checks.sh
source "$repository/tests/meta/verdict_checks.sh"

# make_project NAME: a header, a source that includes it and one that does not, and the commands that compile them.
make_project() {
  local name
  mkdir -p "$folder/$1/build"
  cd "$folder/$1"
  git init --quiet .
  echo 'int one();' >one.hpp
  printf '#include "one.hpp"\nint one() { return 1; }\n' >one.cpp
  echo 'int two() { return 2; }' >two.cpp
  echo 'int left_out();' >left_out.cpp
  echo 'Checks: some' >.clang-tidy
  git add .
  for name in one two; do
    echo "{\"directory\": \"$PWD/build\", \"file\": \"../$name.cpp\", \"command\": \"c++ -MD -MF $name.d -o $name.o -c ../$name.cpp\"}"
  done | paste -sd, | sed 's/.*/[&]/' >build/compile_commands.json
}

# Notes what it is asked to look at, and finds BAD in a source and its header.
cat >"$folder/clang-tidy" <<'TIDY'
#!/usr/bin/env bash
here=$(dirname "$0")
if [[ $1 == --version ]]; then cat "$here/version"; exit; fi
file=${*: -1}
echo "$file" >>"$here/looked"
if grep -q CRASH "$file"; then kill -SEGV $$; fi
! grep -n BAD "$file" "${file%.cpp}.hpp" 2>/dev/null | sed 's/^/:1:1: error: /' | grep .
TIDY
chmod +x "$folder/clang-tidy"
echo 'version 14' >"$folder/version"

look() {
  "$repository/tests/ci/tidy.py" --build build --jobs 1 --clang-tidy "$folder/clang-tidy" "$@"
}

make_project first
expect "at first" "one.cpp two.cpp" 0
expect "nothing has changed" "" 0
expect "but asked to" "one.cpp two.cpp" 0 --again
make_project second
expect "the same in another folder" "" 0
echo '// more' >>one.hpp
expect "a header" "one.cpp" 0
echo '// more' >>two.cpp
expect "a source" "two.cpp" 0
sed -i 's/c++ -MD -MF two/c++ -DMORE -MD -MF two/' build/compile_commands.json
expect "a command" "two.cpp" 0
echo 'Checks: more' >.clang-tidy
expect "the checks" "one.cpp two.cpp" 0
echo 'version 15' >"$folder/version"
expect "the version" "one.cpp two.cpp" 0
echo '// BAD' >>one.hpp
expect "a finding" "one.cpp" 1
expect "the same again" "one.cpp" 1
grep -q 'error: .*BAD' "$folder/out" || fail "the finding is missing: $(cat "$folder/out")"
sed -i '/BAD/d' one.hpp
expect "it is gone, and all is as it was" "" 0
echo '// CRASH' >>two.cpp
expect "clang-tidy crashes" "two.cpp" 1
echo '#include "missing.hpp"' >two.cpp
expect "what it includes is missing" "two.cpp" 0
expect "nothing is kept of that" "two.cpp" 0
expect "a part" "" 0 --part 1/2
expect "the other part" "two.cpp" 0 --part 2/2
expect "a part and more" "two.cpp" 0 --part 1/2 --and two.cpp --and left_out.cpp
expect "one source" "" 0 --only one.cpp
expect "one that the build does not compile" "" 2 --only left_out.cpp
expect "a part that is none" "" 2 --part 3/2
make_old
expect "what is asked for stays" "two.cpp" 0
expect_kept 1
