# Makes a page of the documents the main one of the header's pages: links to files that are no pages become text.
/\]\(/ {
  while (match($0, /\]\([^)]*\)/)) $0 = substr($0, 1, RSTART - 1) substr($0, RSTART + RLENGTH)
  gsub(/\[/, "")
}
{ print }
