# Counts the lines, and the numeric constants that have a name (constexpr), of each directory of C++ files. Prints a
# row a directory: directory, files, lines, constants, and how many of these are tuned: numbers as they stand, neither
# computed from other constants, nor masks and flags, nor marked as fixed. A comment with the word "fixed:" marks the
# declaration that it follows on its line or, on lines of its own, all declarations below it up to the next blank line
# or comment of that kind. With -v list=1 prints the tuned constants themselves.

# What `{` begins, by the text before it: a namespace, a class, an initializer, or anything else.
function kindOf(text,  head) {
  head = text
  while (gsub(/<[^<>]*>/, " ", head)) {}
  if (head ~ /(^|[^a-zA-Z_])(namespace|extern)([^a-zA-Z_]|$)/) return "n"
  if (head ~ /(^|[^a-zA-Z_])enum([^a-zA-Z_]|$)/) return "o"
  if (head ~ /(^|[^a-zA-Z_])constexpr([^a-zA-Z_]|$)/ && !isFunction(head)) return "i"
  if (head ~ /(^|[^a-zA-Z_])(class|struct|union)([^a-zA-Z_]|$)/ && head !~ /=/ && head !~ /\)[^()]*$/) return "n"
  if (head ~ /(class|struct|union) +alignas *\([^()]*\)[^()]*$/) return "n"
  return "o"
}
function isFunction(text) {
  sub(/[=].*/, "", text)
  return text ~ /\(/
}

function finish(text,  type, parts, count, i) {
  if (text !~ /(^|[^a-zA-Z_])constexpr([^a-zA-Z_]|$)/) return
  gsub(/<</, "@", text)
  while (gsub(/<[^<>]*>/, " ", text) || gsub(/\([^()]*\)/, " computed ", text)) {}
  if (isFunction(text)) return
  type = text
  sub(/.*constexpr/, "", type)
  sub(/=.*/, "", type)
  if (type !~ /^[ \t]*(const )?[ \t]*((std::)?(u?int(8|16|32|64)_t|size_t|ptrdiff_t)|unsigned|signed|int|long|short|float|double|Real|dReal|Slot|Pair|Place|Grain|auto)[ \t]/) return
  if (type ~ /\[/ || text ~ /= *\[/) return
  if (type ~ /[ \t]Grain[ \t]/) sub(/,.*/, "", text)
  count = split(text, parts, ",")
  for (i = 1; i <= count; ++i) {
    ++constants[room]
    if (fixed || fixed_block || !isTuned(parts[i])) continue
    ++tuned[room]
    if (list) print file ":" words(parts[i])
  }
}
function isTuned(declaration,  value) {
  value = declaration
  sub(/[^=]*=/, "", value)
  gsub(/std::[a-z0-9_]+|dReal|Real|Slot|Pair|Place/, "", value)
  if (value ~ /~|0xf+[^0-9a-f]*$|@ *(31|63)|0x80000000/) return 0
  gsub(/0x[0-9a-f.]+(p-?[0-9]+)?[fuUlL]*|[0-9][0-9.]*(e-?[0-9]+)?[fuUlL]*/, "", value)
  return value !~ /[a-zA-Z_]/
}
function words(text) {
  gsub(/@/, "<<", text)
  gsub(/[ \t]+/, " ", text)
  return text
}

function take(mark,  kind) {
  if (mark == "(") ++parens
  if (mark == ")") --parens
  if (mark == "{") {
    kind = parens > 0 ? "o" : kindOf(text)
    stack[++depth] = kind (parens > 0 ? "p" : "")
    if (kind == "i" && !outside) text = text " "
    if (kind != "n" && kind != "i") ++outside
    if (kind == "i" || parens > 0) return
    text = ""
    return
  }
  if (mark == "}") {
    kind = stack[depth--]
    if (kind != "n" && kind != "i") --outside
    if (kind == "i" || kind == "op") return
    text = ""
    return
  }
  if (mark == ";" && parens == 0) {
    finish(text)
    text = ""
    return
  }
  if (!outside) text = text mark
}

FNR == 1 {
  file = FILENAME
  room = FILENAME
  sub(/\/[^\/]*$/, "", room)
  ++files[room]
  text = inner = ""
  parens = depth = outside = comment = directive = fixed = fixed_block = remark = 0
}
{
  ++lines[room]
  line = $0
  if (directive || line ~ /^[ \t]*#/) {
    directive = line ~ /\\$/
    next
  }
  gsub(/"([^"\\]|\\.)*"/, "S", line)
  gsub(/'([^'\\]|\\.)'/, "0", line)
  if (comment) {
    if (!sub(/^.*\*\//, "", line)) next
    comment = 0
  }
  alone = line ~ /^[ \t]*(\/\/|$)/
  if (line ~ /^[ \t]*$/ || (alone && !remark)) fixed_block = 0
  remark = alone
  if (line ~ /\/\/.*fixed: /) {
    if (alone) fixed_block = 1
    else fixed = 1
  }
  sub(/\/\/.*/, "", line)
  gsub(/\/\*[^*]*\*\//, "", line)
  if (sub(/\/\*.*/, "", line)) comment = 1
  gsub(/(public|private|protected):/, "", line)
  # Within functions a declaration has its line to itself.
  if (outside && !alone && (inner != "" || line ~ /^[ \t]*(static )?constexpr /)) {
    inner = inner line " "
    if (line ~ /;/) {
      sub(/;.*/, "", inner)
      gsub(/[{}]/, " ", inner)
      finish(inner)
      inner = ""
    }
  }
  while (match(line, /[{}();]/)) {
    if (!outside) text = text substr(line, 1, RSTART - 1)
    take(substr(line, RSTART, 1))
    line = substr(line, RSTART + 1)
  }
  if (!outside) text = text line " "
  if (text !~ /[^ \t]/ && inner == "") fixed = 0
}
END {
  if (!list)
    for (room in files) print room, files[room], lines[room], constants[room] + 0, tuned[room] + 0
}
