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
  constexpr int inside = 2;
  return inside * value;
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
| `space/data` | 1 | 32 | 9 | 6 |
| all of `space` | 1 | 32 | 9 | 6 |
| all of `cuda` | 1 | 3 | 2 | 2 |'
diff <(echo "$expected") <("$here/sizes.sh" "$folder")
