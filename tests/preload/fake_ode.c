/* A libode that is another one than the library was built for: of the other precision, or, with
 * OWN_PRECISION=1, of the same precision but another file. Its spaces are the addresses of four
 * characters, so that a program can see whether it got one. */
#include <string.h>

char fake_spaces[4];
const char fake_type_information __asm__("_ZTI7dxSpace");
const char fake_type_information = 0;

int dCheckConfiguration(const char* token) {
  const int is_built_for = strcmp(token, BUILD_PRECISION_TOKEN) == 0;
  return is_built_for == OWN_PRECISION;
}
void* dSimpleSpaceCreate(void* parent) {
  return (void)parent, fake_spaces;
}
void* dHashSpaceCreate(void* parent) {
  return (void)parent, fake_spaces + 1;
}
