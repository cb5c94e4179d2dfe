// Which words of contacts a collider has written.
#ifndef ODE_PARALLEL_SAP_WRITTEN_WORDS_H
#define ODE_PARALLEL_SAP_WRITTEN_WORDS_H

#include <ode/ode.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace ode_parallel_sap {

// ODE's colliders leave some words of a contact as the caller had them (the fourth of a position,
// for instance). Contacts that are copied to the caller must not write those either. So storage is
// filled with a word first that no collider writes: as a number it is a signalling NaN, which no
// arithmetic returns; as half an address it is odd, or of no process.
using ContactWord =
    std::conditional<sizeof(dReal) == sizeof(double), std::uint64_t, std::uint32_t>::type;
constexpr ContactWord unwritten_word =
    static_cast<ContactWord>(sizeof(dReal) == sizeof(double) ? 0x7ff4a5c35a3ca5c3 : 0x7fa5a5c3);
constexpr std::size_t contact_words = sizeof(dContactGeom) / sizeof(ContactWord);
static_assert(sizeof(dContactGeom) % sizeof(ContactWord) == 0, "a contact is whole words");

inline void markUnwritten(dContactGeom* contacts, std::size_t count) {
  char* bytes = reinterpret_cast<char*>(contacts);
  for (std::size_t word = 0; word < count * contact_words; ++word, bytes += sizeof unwritten_word)
    std::memcpy(bytes, &unwritten_word, sizeof unwritten_word);
}

inline void copyWritten(const dContactGeom& from, char* to) {
  ContactWord words[contact_words];
  std::memcpy(words, &from, sizeof words);
  for (std::size_t word = 0; word < contact_words; ++word)
    if (words[word] != unwritten_word)
      std::memcpy(to + word * sizeof(ContactWord), &words[word], sizeof(ContactWord));
}

}  // namespace ode_parallel_sap

#endif
