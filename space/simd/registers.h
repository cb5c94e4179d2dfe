// A register of lanes, in the notation that GCC and Clang have for all instruction sets. Internal
// linkage, as in kernels_impl.h.
#pragma once

namespace {

#if defined(__AVX512F__)
constexpr int register_bytes = 64;  // fixed: of the vectors
#elif defined(__AVX__)
constexpr int register_bytes = 32;  // fixed: of the vectors
#else
constexpr int register_bytes = 16;  // fixed: of the vectors
#endif

template <class Real>
struct Register {
  static constexpr int lanes = register_bytes / sizeof(Real);
  typedef Real Type __attribute__((vector_size(register_bytes), may_alias));

  // The lesser or greater of both; the second one where one is NaN.
  static Type least(Type a, Type b) { return a < b ? a : b; }
  static Type greatest(Type a, Type b) { return a > b ? a : b; }
};

}  // namespace
