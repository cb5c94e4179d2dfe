/* How a switch in the environment is read, by the library (C++) and the preload library (C). */
#pragma once

/* 1 for "1"; 0 for "0" and for nothing; -1 for anything else, which is not understood. `text` may
 * be null. */
static inline int switchOf(const char* text) {
  if (!text || text[0] == '\0') return 0;
  if (text[1] != '\0') return -1;
  return text[0] == '1' ? 1 : text[0] == '0' ? 0 : -1;
}
