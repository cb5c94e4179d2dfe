// Limits of what the process may have.
#pragma once

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

namespace sap_test {

// At most `most` threads, those that there are among them, as long as it lives. Where the user's
// other processes count as well there may be fewer. The system has no such limit for root, so the
// process becomes that of a user who has no other, for good.
class ThreadLimit {
 public:
  explicit ThreadLimit(rlim_t most) {
    const uid_t nobody_else = 100000 + static_cast<uid_t>(getpid());
    if (getuid() == 0 && setuid(nobody_else) != 0) throw std::runtime_error("setuid");
    prctl(PR_SET_DUMPABLE, 1);  // or sanitizers could not look for leaks at the end
    getrlimit(RLIMIT_NPROC, &before_);
    const rlimit limit = {most, before_.rlim_max};
    if (setrlimit(RLIMIT_NPROC, &limit) != 0) throw std::runtime_error("setrlimit");
  }
  ~ThreadLimit() { setrlimit(RLIMIT_NPROC, &before_); }
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  rlimit before_;
};

// At most `more` bytes of address space beyond those that it has, as long as it lives.
class AddressSpaceLimit {
 public:
  explicit AddressSpaceLimit(rlim_t more) {
    rlim_t pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    getrlimit(RLIMIT_AS, &before_);
    const rlimit limit = {pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + more,
                          before_.rlim_max};
    if (setrlimit(RLIMIT_AS, &limit) != 0) throw std::runtime_error("setrlimit");
  }
  ~AddressSpaceLimit() { setrlimit(RLIMIT_AS, &before_); }
  AddressSpaceLimit(const AddressSpaceLimit&) = delete;
  AddressSpaceLimit& operator=(const AddressSpaceLimit&) = delete;

 private:
  rlimit before_;
};

}  // namespace sap_test
