/* Makes two spaces with fake_ode.c, and prints whether it got that library's. */
#include <stdio.h>

extern char fake_spaces[4];
void* dSimpleSpaceCreate(void* parent);
void* dHashSpaceCreate(void* parent);

int main(void) {
  const int kept =
      dSimpleSpaceCreate(NULL) == fake_spaces && dHashSpaceCreate(NULL) == fake_spaces + 1;
  puts(kept ? "stock spaces" : "other spaces");
  return 0;
}
