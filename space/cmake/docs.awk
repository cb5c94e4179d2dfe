# Makes the plain comments of the public header ones that Doxygen reads: those that begin a line
# belong to what follows, those behind code to that. A function that follows another without a
# comment of its own shares the comment, and so do fields that are declared together.
FNR == 1 { sub(/^\/\* /, "/** @file\n * @brief ") }
# Macros in the place of functions of the same names.
/^#if .*__STDC_VERSION__/, /^#endif/ { next }
# What stands alone is about the header as a whole.
/^\/\* Environment variables/ { sub(/\/\* /, "/** @file\n * ") }
/^ *\/\* / { sub(/\/\* /, "/** ") }
!/^ *(\/\*| \*)/ && / \/\* / { sub(/ \/\* /, " /**< ") }
match($0, /^  [a-zA-Z0-9 ]+ [a-z0-9_]+(\[[0-9]\])?, [^;(]*; +\/\*/) {
  fields = substr($0, 1, index($0, ";") - 1)
  comment = substr($0, index($0, ";"))
  match(fields, /^  [a-zA-Z0-9 ]+ /)
  type = substr(fields, 1, RLENGTH)
  count = split(substr(fields, RLENGTH + 1), each, ", ")
  for (i = 1; i < count; ++i) print type each[i] comment
  $0 = type each[count] comment
}
/^ODE_PARALLEL_SAP_API / && name && previous ~ /\);$/ { print "/** @copydoc " name " */" }
/^ODE_PARALLEL_SAP_API / { match($0, /d[A-Za-z0-9]*\(/); name = substr($0, RSTART, RLENGTH - 1) }
{ print }
{ previous = $0 }
