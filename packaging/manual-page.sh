#!/bin/sh
# Makes a manual page out of a page of docs/: its first heading is what the manual's title line says already. What the page does not say,
# as where to read on, is appended from MORE. DOC is the folder in which README.md, docs and examples will be installed.
# usage: manual-page.sh LOWDOWN PAGE.md NAME SECTION TITLE VERSION DOC MORE OUT.gz
set -eu

# The tables of keys and of commands have up to five columns, and their longest words do not fit beside each other into 80 characters. In the
# manual they are lists: the key, below it what the columns between have, where they have something, and then the last column. Headings stand
# before what they are of, the last one up to a comma, and none where it is "meaning".
lists_of_keys() {
  awk -F ' *[|] *' '
    /^[|] (key|command) [|]/ {
      is_list = 1
      last = NF - 1
      for (i = 3; i <= last; ++i) heading[i] = $i
      sub(/,.*/, "", heading[last])
      heading[last] = heading[last] == "meaning" ? "" : heading[last] ": "
      getline
      next
    }
    !is_list || !/^[|]/ { is_list = 0; print; next }
    {
      facts = ""
      for (i = 3; i < last; ++i) if ($i != "") facts = facts (facts == "" ? "" : "; ") heading[i] ": " $i
      printf "%s\n: %s%s%s\n\n", $2, facts == "" ? "" : facts "  \n  ", heading[last], $last
    }'
}

# A link leads from page to page, and a manual lies elsewhere: it names the manual of a program or of a page that has one, and else the file.
# A link that can lead nowhere ends this with 1.
links_of_manual() {
  awk -v doc="$doc" '
    BEGIN {
      split("bmucell bmuctl bmudump", programs, " ")
      for (i in programs) manual[programs[i] ".md"] = programs[i] "(1)"
      manual["configuration.md"] = "bmud-pack(5)"
      manual["socket-protocol.md"] = "bmud-socket(7)"
    }
    function in_manual(text, target) {
      if (target ~ /^[a-z]+:/) return "[" text "](" target ")"
      sub(/#.*/, "", target)
      if (target == "") return text
      if (target in manual) return index(manual[target], text "(") == 1 ? manual[target] : text " (" manual[target] ")"
      if (target ~ /^[.][.]\/systemd\//) sub(/^[.][.]\/systemd/, doc "/examples", target)
      else if (target ~ /^[^.\/].*[.]md$/) target = doc "/docs/" target
      else { print "manual-page.sh: found a link to " target ", expected a page or a file of systemd/" >"/dev/stderr"; exit 1 }
      return "[" text "](" target ")"
    }
    /^```/ { is_code = !is_code }
    is_code || /^    / { print; next }
    {
      line = ""
      while (match($0, /\[[^][]*\]\([^()]*\)/)) {
        link = substr($0, RSTART + 1, RLENGTH - 2)
        middle = index(link, "](")
        line = line substr($0, 1, RSTART - 1) in_manual(substr(link, 1, middle - 1), substr(link, middle + 2))
        $0 = substr($0, RSTART + RLENGTH)
      }
      if (/\]\(/) { print "manual-page.sh: found a link over two lines, expected it on one: " $0 >"/dev/stderr"; exit 1 }
      print line $0
    }'
}

lowdown=$1 source=$2 name=$3 section=$4 title=$5 version=$6 doc=$7 more=$8 out=$9
upper=$(printf %s "$name" | tr '[:lower:]' '[:upper:]')
# By itself, since a pipe would not tell that it has failed.
text=$(sed 1d "$source" | links_of_manual)
{
  # A table is drawn by tbl, which man runs before when the first line asks for it.
  printf "'\\\\\" t\n.TH %s %s \"\" \"bmud %s\" \"bmud, a battery management master\"\n" "$upper" "$section" "$version"
  # Words as long as paths cannot be spread over the columns of a table, and whoever copies a name wants no hyphen in it; each heading
  # sets hyphens anew, as HY tells it.
  printf '.ad l\n.nr HY 0\n.nh\n'
  printf '.SH NAME\n%s \\- %s\n.SH DESCRIPTION\n' "$name" "$title"
  # The last column of a table has the room that the others leave. The path of a link is not broken at its hyphens.
  printf '%s\n' "$text" | lists_of_keys | "$lowdown" -T man |
    sed -E -e '/^\.\\" -\*-/d' -e ':again' -e 's/(<\\fI([^->\\]|\\-)*)-/\1\\-/' -e 't again' \
      -e 's/^tab\(\|\) expand allbox;/tab(|) allbox;/' -e 's/^((lb? )+)(lb?)(\.?)$/\1\3x\4/'
  cat "$more"
} | gzip -9n >"$out"
