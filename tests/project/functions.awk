# Of the tags of functions, with line, end and signature: prints "lines parameters file:line name".
{
  line = end = signature = ""
  for (i = 4; i <= NF; ++i) {
    if ($i ~ /^line:/) line = substr($i, 6)
    if ($i ~ /^end:/) end = substr($i, 5)
    if ($i ~ /^signature:/) signature = substr($i, 11)
  }
  sub(/^\(/, "", signature)
  sub(/\)[^()]*$/, "", signature)
  while (gsub(/<[^<>]*>|\([^()]*\)|\{[^{}]*\}/, "", signature)) {}
  parameters = signature ~ /[^ \t]/ ? gsub(/,/, ",", signature) + 1 : 0
  print end - line + 1, parameters, $2 ":" line, $1
}
