# Makes the man pages from pages.txt: awk -v version=... -v folder=... -f make_pages.awk pages.txt
#
# A page begins with "= name [other names] (section)"; "name:" says what it is for in a line. Then come sections, each a line in
# capitals. Lines that begin with two blanks stay as they are, an empty line ends a paragraph, "-x  text" in OPTIONS is an item.
function escaped(line) {
  gsub(/\\/, "\\e", line)
  gsub(/-/, "\\-", line)
  if (line ~ /^['.]/) line = "\\&" line
  return line
}
function with_bold_names(line) {
  gsub(/(bsp_[a-zA-Z_]+|bspcc|bspcxx|bsprun|bsp2\\-profile|bsp2\\-probe|BSP2_[A-Z_]+)/, "\\fB&\\fR", line)
  return line
}
function verbatim(wanted) {
  if (wanted != in_verbatim) print wanted ? ".PP\n.nf\n.RS" : ".RE\n.fi" > page
  in_verbatim = wanted
}
function finish() {
  if (page == "") return
  verbatim(0)
  close(page)
}
/^#/ { next }
/^= / {
  finish()
  section = $NF
  gsub(/[()]/, "", section)
  page = folder "/man" section "/" $2 "." section
  names = escaped($2)
  for (i = 3; i < NF; ++i) {
    other = folder "/man" section "/" $i "." section
    print ".so man" section "/" $2 "." section > other
    close(other)
    names = names ", " escaped($i)
  }
  in_verbatim = 0
  in_options = 0
  print ".TH \"" toupper($2) "\" " section " \"\" \"BSP2 " version "\" \"BSPlib\"" > page
  next
}
/^name: / {
  sub(/^name: /, "")
  print ".SH NAME\n" names " \\- " escaped($0) > page
  next
}
/^[A-Z][A-Z ]+$/ {
  verbatim(0)
  in_options = $0 == "OPTIONS" || $0 == "ENVIRONMENT" || $0 == "COLUMNS"
  print ".SH \"" $0 "\"" > page
  next
}
/^  / {
  verbatim(1)
  print escaped(substr($0, 3)) > page
  next
}
/^$/ {
  if (page != "" && !in_verbatim) print ".PP" > page
  next
}
{
  verbatim(0)
  if (in_options && match($0, /   */)) {
    print ".TP\n\\fB" escaped(substr($0, 1, RSTART - 1)) "\\fR" > page
    $0 = substr($0, RSTART + RLENGTH)
  }
  print with_bold_names(escaped($0)) > page
}
END { finish() }
