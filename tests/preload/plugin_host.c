/* plugin_host PLUGIN [ARGUMENT]: opens a plug-in that is linked with ODE, as Python opens its
 * modules (so its ODE is seen by the plug-in alone), and calls its function `run`. */
#include <dlfcn.h>
#include <stdio.h>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  void* const plugin = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  int (*const run)(int, char**) = plugin ? (int (*)(int, char**))dlsym(plugin, "run") : NULL;
  if (!run) {
    fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  return run(argc - 1, argv + 1);
}
