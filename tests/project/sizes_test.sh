#!/usr/bin/env bash
# Holds the counts of sizes.sh against counts by hand.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir -p "$folder/space/data" "$folder/cuda/one"
cat >"$folder/space/data/some.h" <<'END'
#define constexpr_like constexpr int none = 1;
// constexpr int in_a_comment = 1;
namespace some {
constexpr int a = 1, b = 2;                       // two
constexpr std::size_t c = std::size_t{1} << 18;   // one
constexpr double d = 1.0 / 32;                    // one
constexpr std::uint32_t mask = 0xffff;            // not tuned
constexpr std::uint32_t flag = std::uint32_t{1} << 31;  // not tuned
constexpr int twice_a = 2 * a;                    // not tuned
constexpr bool yes = true;
constexpr const char* name = "constexpr int in_a_string = 1;";
constexpr int doubled(int value) {
  constexpr int inside = 2;  // one
  constexpr std::size_t few =
      std::size_t{1} << 6;  // one
  if constexpr (inside == 2) return inside * value;
  constexpr auto lambda = [](int i) { return 2 * i; };
}
template <class Real, class = std::enable_if_t<true>>
class alignas(64) Thing : public Base<Real> {
 public:
  static constexpr int e = 5;  // one
  Thing() : member_{} { for (int i = 0; i < e; ++i) {} }
  bool operator==(const Thing&) const { constexpr int inside = 2; return inside == 2; }

 private:
  struct Inner {
    static constexpr float f = 1e-3f;  // one
  };
  /* constexpr int commented = 1;
     constexpr int too = 1; */
  int member_;
};
enum class Kind { One, Two };
constexpr Grain grain = {1 << 10, Grain::whole, 4096};          // one
constexpr Grain derived = {a / 2, Grain::whole};                // not tuned
constexpr std::uint8_t table[] = {1, 2, 3};                     // none
constexpr int word = 64, half_word = 32;  // fixed: bits of a word. Not tuned
constexpr int after = 5;                  // one

// fixed: the layout of a key.
constexpr int key_digits = 24;  // of all
constexpr int class_digits =
    5;
// Another comment.
constexpr int of_its_own = 7;  // one

// As ODE has it; fixed: its limit.
constexpr int limit = 1024;

constexpr int last = 1;  // one
}  // namespace some
END
cat >"$folder/cuda/one/some.cu" <<'END'
namespace { constexpr int threads = 256; }
__global__ void kernel() { constexpr int inside = 1; }
constexpr long g = 7;
END
expected='| room | files | lines | constants | tuned |
| --- | ---: | ---: | ---: | ---: |
| `cuda/one` | 1 | 3 | 2 | 2 |
| `space/data` | 1 | 52 | 21 | 12 |
| all of `space` | 1 | 52 | 21 | 12 |
| all of `cuda` | 1 | 3 | 2 | 2 |'
diff <(echo "$expected") <("$here/sizes.sh" "$folder")
expected='cuda/one/some.cu: constexpr int threads = 256
cuda/one/some.cu: constexpr long g = 7
space/data/some.h: constexpr int a = 1
space/data/some.h: b = 2
space/data/some.h: constexpr std::size_t c = std::size_t 1 << 18
space/data/some.h: constexpr double d = 1.0 / 32
space/data/some.h: constexpr int inside = 2
space/data/some.h: constexpr std::size_t few = std::size_t 1 << 6
space/data/some.h: static constexpr int e = 5
space/data/some.h: static constexpr float f = 1e-3f
space/data/some.h: constexpr Grain grain = 1 << 10
space/data/some.h: constexpr int after = 5
space/data/some.h: constexpr int of_its_own = 7
space/data/some.h: constexpr int last = 1'
diff <(echo "$expected") <("$here/sizes.sh" "$folder" --list | sed 's/ *$//;s/  */ /g')

# Constants are all in one header a room, no more than so many.
fails() { # fails WORDS: that constants.sh ends with an error and says so
  local said
  if said=$("$here/constants.sh" "$folder"); then
    echo "constants.sh finds nothing wrong: $said"
    exit 1
  fi
  grep -qF -- "$1" <<<"$said" || { echo "constants.sh does not say '$1': $said" && exit 1; }
}
fails 'cuda/one/some.cu: constexpr int threads = 256'
rm "$folder/cuda/one/some.cu"
mv "$folder/space/data/some.h" "$folder/space/data/tuning.h"
"$here/constants.sh" "$folder" >/dev/null
for i in {1..90}; do echo "constexpr int constant$i = $i;"; done >"$folder/cuda/one/tuning.h"
fails '102 tuned constants'
