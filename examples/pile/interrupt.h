#ifndef PILE_INTERRUPT_H
#define PILE_INTERRUPT_H

namespace pile {

// While this lives, the first SIGINT (Ctrl-C) or SIGTERM only asks the run to end after its step; a
// second one of the kind ends the program as ever. A signal that the program was started to ignore
// stays ignored. One lives at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // The signal that came, or 0.
  static int signal();
};

}  // namespace pile

#endif
