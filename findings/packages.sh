# Sourced by the scripts beside it, which run a program with pinned Debian 12 packages (amd64) out of a temporary folder.
# They end with 0 if the program does what was seen, with 1 if it does not, with 2 if there are no packages.
set -eu
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT
library=$room/usr/lib/$(gcc -print-multiarch)

packages() { # PACKAGE=VERSION...
  printf '%s\n' "$@"
  if ! (cd "$room" && apt-get -qq -o APT::Sandbox::User=root download "$@" &&
    for package in ./*.deb; do dpkg -x "$package" . || exit; done); then
    echo "these packages could not be had, so nothing was tested" >&2
    exit 2
  fi
}

ode() {
  packages libode8=2:0.16.2-1 libode-dev=2:0.16.2-1 libccd2=2.1-2+b1
}

program() { # FLAGS of the compiler; the source is standard input
  g++ -std=c++17 -O1 -w -I"$room/usr/include" -x c++ - -o "$room/program" -L"$library" -Wl,-rpath,"$library" \
    -Wl,-rpath-link,"$library" "$@"
}

shows() { # what was seen is standard input; fails if the program prints anything else
  cat >"$room/seen"
  "$room/program" | tee "$room/now"
  diff -u "$room/seen" "$room/now"
}
