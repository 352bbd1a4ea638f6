#!/bin/sh
# Makes a manual page out of a page of docs/: its first heading is what the manual's title line says already.
# usage: manual-page.sh LOWDOWN PAGE.md NAME SECTION TITLE VERSION OUT.gz
set -eu

# The tables of keys have five columns, and their longest words do not fit beside each other into 80 characters. In the manual they are
# lists: the key, below it unit, range and default where they are given, and the meaning.
lists_of_keys() {
  awk -F ' *[|] *' '
    $0 == "| key | unit | range | default | meaning |" { is_keys = 1; getline; next }
    !is_keys || !/^[|]/ { is_keys = 0; print; next }
    {
      facts = ""
      for (i = 3; i <= 5; ++i) if ($i != "") facts = facts (facts == "" ? "" : "; ") heading[i] ": " $i
      printf "%s\n: %s%s\n\n", $2, facts == "" ? "" : facts "  \n  ", $6
    }
    BEGIN { heading[3] = "unit"; heading[4] = "range"; heading[5] = "default" }'
}

lowdown=$1 source=$2 name=$3 section=$4 title=$5 version=$6 out=$7
upper=$(printf %s "$name" | tr '[:lower:]' '[:upper:]')
{
  # A table is drawn by tbl, which man runs before when the first line asks for it.
  printf "'\\\\\" t\n.TH %s %s \"\" \"bmud %s\" \"bmud, a battery management master\"\n" "$upper" "$section" "$version"
  # Words as long as paths cannot be spread over the columns of a table, and whoever copies a name wants no hyphen in it; each heading
  # sets hyphens anew, as HY tells it.
  printf '.ad l\n.nr HY 0\n.nh\n'
  printf '.SH NAME\n%s \\- %s\n.SH DESCRIPTION\n' "$name" "$title"
  # The last column of a table has the room that the others leave.
  sed 1d "$source" | lists_of_keys | "$lowdown" -T man |
    sed -E -e '/^\.\\" -\*-/d' -e 's/^tab\(\|\) expand allbox;/tab(|) allbox;/' -e 's/^((lb? )+)(lb?)(\.?)$/\1\3x\4/'
} | gzip -9n >"$out"
