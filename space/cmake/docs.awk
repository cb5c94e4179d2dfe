# Makes the plain comments of the public header ones that Doxygen reads: those that begin a line
# belong to what follows, those behind code to that. A function that follows another without a
# comment of its own shares the comment.
FNR == 1 { sub(/^\/\* /, "/** @file\n * @brief ") }
# Macros in the place of functions of the same names.
/^#if .*__STDC_VERSION__/, /^#endif/ { next }
# What stands alone is about the header as a whole.
/^\/\* Environment variables/ { sub(/\/\* /, "/** @file\n * ") }
/^ *\/\* / { sub(/\/\* /, "/** ") }
!/^ *(\/\*| \*)/ && / \/\* / { sub(/ \/\* /, " /**< ") }
/^ODE_PARALLEL_SAP_API / && name && previous ~ /\);$/ { print "/** @copydoc " name " */" }
/^ODE_PARALLEL_SAP_API / { match($0, /d[A-Za-z0-9]*\(/); name = substr($0, RSTART, RLENGTH - 1) }
{ print }
{ previous = $0 }
