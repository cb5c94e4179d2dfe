# Counts the lines, and the numeric constants that have a name (constexpr, at namespace or class scope), of each
# directory of C++ files. Prints a row a directory: directory, files, lines, constants, and how many of these are
# tuned: numbers as they stand, neither computed from other constants nor masks and flags. With -v list=1 prints the
# tuned constants themselves.

function inDeclarations() { return outside == 0 }

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
  if (!inDeclarations() || text !~ /(^|[^a-zA-Z_])constexpr([^a-zA-Z_]|$)/) return
  gsub(/<</, "@", text)
  while (gsub(/<[^<>]*>/, " ", text) || gsub(/\([^()]*\)/, " computed ", text)) {}
  if (isFunction(text)) return
  type = text
  sub(/.*constexpr/, "", type)
  sub(/=.*/, "", type)
  if (type !~ /^[ \t]*(const )?[ \t]*((std::)?(u?int(8|16|32|64)_t|size_t|ptrdiff_t)|unsigned|signed|int|long|short|float|double|Real|dReal|Slot|Pair|Place|auto)[ \t]/) return
  count = split(text, parts, ",")
  for (i = 1; i <= count; ++i) {
    ++constants[room]
    if (!isTuned(parts[i])) continue
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
    if (kind != "n") ++outside
    if (kind == "i" || parens > 0) return
    text = ""
    return
  }
  if (mark == "}") {
    kind = stack[depth--]
    if (kind != "n") --outside
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
  text = ""
  parens = depth = outside = comment = directive = 0
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
  sub(/\/\/.*/, "", line)
  gsub(/\/\*[^*]*\*\//, "", line)
  if (sub(/\/\*.*/, "", line)) comment = 1
  gsub(/(public|private|protected):/, "", line)
  while (match(line, /[{}();]/)) {
    if (!outside) text = text substr(line, 1, RSTART - 1)
    take(substr(line, RSTART, 1))
    line = substr(line, RSTART + 1)
  }
  if (!outside) text = text line " "
}
END {
  if (!list)
    for (room in files) print room, files[room], lines[room], constants[room] + 0, tuned[room] + 0
}
