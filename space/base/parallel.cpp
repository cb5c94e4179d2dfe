#include "space/base/parallel.h"

#include <omp.h>
#include <pthread.h>

#include <cctype>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <mutex>
#include <new>
#include <thread>

#include "space/base/floating_point.h"
#include "space/base/platform.h"

namespace ode_parallel_sap {

namespace {

using Clock = std::chrono::steady_clock;

// Of OpenMP's threads, which has no function for it; 0: the system's usual size.
std::size_t stackSize() {
  const char* text = std::getenv("OMP_STACKSIZE");
  if (!text) text = std::getenv("GOMP_STACKSIZE");
  unsigned long long number = 0;
  char unit = 'k';
  if (!text || std::sscanf(text, "%llu %c", &number, &unit) < 1) return 0;
  static constexpr char units[] = "bkmg";
  const char* const found = std::strchr(units, std::tolower(static_cast<unsigned char>(unit)));
  return static_cast<std::size_t>(number) << 10 * (found ? found - units : 1);
}

// A thread that ends when the gate is opened.
struct Probe {
  pthread_t thread;
  std::mutex* gate;
  long id;

  bool start(const pthread_attr_t& attributes, std::mutex& closed_gate) {
    gate = &closed_gate;
    return pthread_create(&thread, &attributes, run, this) == 0;
  }
  static void* run(void* self) {
    Probe& probe = *static_cast<Probe*>(self);
    probe.id = threadNumber();
    const std::lock_guard<std::mutex> open(*probe.gate);
    return nullptr;
  }
  void awaitEnd() {
    pthread_join(thread, nullptr);
    awaitRemoval(id);
  }
};

struct Attributes {  // with OpenMP's size of a stack
  pthread_attr_t of_thread;
  Attributes() {
    pthread_attr_init(&of_thread);
    if (const std::size_t size = stackSize()) pthread_attr_setstacksize(&of_thread, size);
  }
  ~Attributes() { pthread_attr_destroy(&of_thread); }
};

// So many threads leave half of the address space to all else. Idle ones only show room for stacks.
std::uint64_t threadsInAddressSpace(const Attributes& attributes) {
  constexpr std::uint64_t heap = 64 << 20;  // fixed: what glibc keeps free for that of a thread
  std::size_t stack = 0;
  pthread_attr_getstacksize(&attributes.of_thread, &stack);
  return freeAddressSpace() / 2 / (heap + stack);
}

// How many of the wanted threads can live at the same time beside those that there are.
int countThreads(int wanted) {
  Probe probes[most_threads];
  const Attributes attributes;
  std::mutex gate;
  gate.lock();
  int count = 0;
  while (count < std::min(wanted, most_threads) && probes[count].start(attributes.of_thread, gate))
    ++count;
  gate.unlock();
  for (int i = 0; i < count; ++i) probes[i].awaitEnd();
  return count;
}

// A thread that waits until it is woken. A wake-up that comes first is not lost.
class Sleeper {
 public:
  // Sleeps unless `isDue()` by now; who makes it due calls wake() after that.
  template <class Due>
  void sleep(Due isDue) {
    asleep_.store(true);
    if (isDue()) return asleep_.store(false);
    std::unique_lock<std::mutex> guard(lock_);
    woken_.wait(guard, [this] { return !asleep_.load(); });
  }
  void wake() {
    if (!asleep_.load() || !asleep_.exchange(false)) return;
    { const std::lock_guard<std::mutex> guard(lock_); }
    woken_.notify_one();
  }

 private:
  std::atomic<bool> asleep_{false};
  std::mutex lock_;
  std::condition_variable woken_;
};

// A team at work: its members, and the threads that take them.
class Job {
 public:
  // Whether the calling thread now has this one, which no other had.
  bool claim() { return !claimed_.load() && !claimed_.exchange(true); }
  void open(const Members& members) {
    members_ = members;
    mode_ = currentMode();
    failed_.clear();
    lacked_.clear();
    arrived_ = workers_ = 0;
    for (int word = 0; word < words; ++word) {
      const int left = std::clamp(members.count - 64 * word, 0, 64);
      free_[word].store(left ? ~std::uint64_t{0} >> (64 - left) : 0, std::memory_order_relaxed);
    }
    gate_.fetch_or(is_open);  // a worker that came too late may still be leaving
  }
  // Waits for the threads that have a member, and for no other. Returns how many threads had work.
  int close(std::exception_ptr& failure) {
    gate_.fetch_and(~is_open);
    // A core that is left to others may be that of a thread which is waited for.
    for (const Clock::time_point end = Clock::now() + short_wait; gate_.load() != 0;)
      if (Clock::now() >= end) caller_.sleep([this] { return gate_.load() == 0; });
    failure = std::exchange(no_memory_, nullptr);
    if (failure_) failure = std::exchange(failure_, nullptr);
    const int workers = workers_.load();
    claimed_.store(false);
    return workers;
  }

  // What a worker does, if there is anything to do.
  bool help(int thread, Sleeper* sleepers) {
    const auto isTaken = [](const auto& word) { return !word.load(std::memory_order_relaxed); };
    if (!(gate_.load() & is_open) || std::all_of(free_, free_ + words, isTaken)) return false;
    const bool opened = gate_.fetch_add(1) & is_open;
    if (opened) work(thread, sleepers);
    if (gate_.fetch_sub(1) == 1) caller_.wake();
    return opened;
  }
  // Wakes others and takes members until none is left, first its own, whose data is in its cache.
  void work(int thread, Sleeper* sleepers) {
    for (int next = fan * thread + 1; next <= fan * thread + fan && next < members_.count; ++next)
      sleepers[next].wake();
    const ScopedMode callers_mode(mode_);
    team_member = {members_.threads};
    bool first = true;
    for (int member; take(thread, first, member); first = false) try {
        members_.call(members_.work, member, members_.count);
      } catch (const std::bad_alloc&) {
        if (!lacked_.test_and_set()) no_memory_ = std::current_exception();
      } catch (...) {
        if (!failed_.test_and_set()) failure_ = std::current_exception();
      }
    workers_ += team_member.worked;
    team_member = {};
  }

 private:
  bool take(int thread, bool first, int& member) {
    if (teamsAreTested()) awaitTeam(arrived_, first);
    for (int i = 0; i < words; ++i) {
      const int word = (thread / 64 + i) % words;
      // The first member is the caller's, who can do all if others lack what they need.
      const std::uint64_t not_mine = thread > 0 && word == 0 ? 1 : 0;
      while (const std::uint64_t left = free_[word].load(std::memory_order_relaxed) & ~not_mine) {
        const bool own = first && i == 0 && left >> thread % 64 & 1;
        const int bit = own ? thread % 64 : __builtin_ctzll(left);
        member = 64 * word + bit;
        const std::uint64_t mask = std::uint64_t{1} << bit;
        if (free_[word].fetch_and(~mask, std::memory_order_relaxed) & mask) return true;
      }
    }
    return false;
  }

  static constexpr std::uint32_t is_open = std::uint32_t{1} << 31;
  static constexpr int words = most_threads / 64;
  static constexpr int fan = 4;  // threads that each thread wakes: all begin soon
  static constexpr std::chrono::microseconds short_wait{100};

  alignas(64) std::atomic<std::uint32_t> gate_{0};  // is_open, and the number of workers inside
  std::atomic<std::uint64_t> free_[words] = {};     // a bit for each member
  alignas(64) Members members_ = {};
  FloatingPointMode mode_ = {};
  std::exception_ptr failure_, no_memory_;
  std::atomic_flag failed_ = ATOMIC_FLAG_INIT, lacked_ = ATOMIC_FLAG_INIT;
  std::atomic<int> arrived_{0}, workers_{0};  // counted in tests
  std::atomic<bool> claimed_{false};
  Sleeper caller_;
};

// OpenMP's threads for all calling threads, in parallel regions that never end, of threads that
// nobody waits for: at its end a region of a calling thread would wait for the last one to come.
class Workers {
 public:
  // Never destroyed: threads may be at work when static objects are.
  static Workers& get() {
    alignas(Workers) static unsigned char place[sizeof(Workers)];
    static Workers& workers = *new (place) Workers;
    return workers;
  }

  int granted(int wanted) {
    if (wanted > wanted_.load()) grow(wanted);
    while (teamsAreTested() && starting_.load()) std::this_thread::yield();
    if (starting_.load()) return wanted;
    const int granted = std::min(wanted, 1 + count_.load());
    static std::atomic<bool> said{false};
    ThreadShortageFunction* const say = on_thread_shortage.load(std::memory_order_relaxed);
    if (granted < wanted && say && !said.exchange(true)) say(granted, wanted);
    return granted;
  }
  bool share(Region& region, const Members& members) {
    Job* const job = std::find_if(jobs_, std::end(jobs_), [](Job& each) { return each.claim(); });
    if (job == std::end(jobs_)) return false;
    job->open(members);
    opened_.fetch_add(1);
    job->work(0, sleepers_);
    std::exception_ptr failure;
    if (job->close(failure) > 1) region.times_shared.fetch_add(1, std::memory_order_relaxed);
    if (failure) std::rethrow_exception(failure);
    return true;
  }

 private:
  void grow(int wanted) {
    const std::lock_guard<std::mutex> guard(growing_);
    if (wanted <= wanted_.load() || closed_.load()) return;
    if (wanted_.load() == 1) {
      onFork(nullptr, nullptr, [] { teams_are_lost.store(true, std::memory_order_relaxed); });
      std::atexit([] { get().close(); });
    }
    starting_.fetch_add(1);  // who finds `wanted_` great enough misses no thread yet
    wanted_.store(wanted);
    Attributes attributes;
    const std::uint64_t room = threadsInAddressSpace(attributes);
    if (room == 0) return static_cast<void>(starting_.fetch_sub(1));
    most_ = 1 + count_.load() + static_cast<int>(std::min<std::uint64_t>(room, most_threads));
    pthread_attr_setdetachstate(&attributes.of_thread, PTHREAD_CREATE_DETACHED);
    pthread_t thread;
    const auto run = [](void* self) -> void* {
      static_cast<Workers*>(self)->start();
      return nullptr;
    };
    if (pthread_create(&thread, &attributes.of_thread, run, this) != 0) starting_.fetch_sub(1);
  }
  // LLVM's OpenMP does not survive exit while it starts threads.
  void close() {
    closed_.store(true);
    while (starting_.load() && !teamsAreLost()) std::this_thread::yield();
  }
  // Makes workers of the calling thread and of OpenMP's. One thread more than needed is tried, so
  // that the rest of the program has one left.
  void start() {
    std::unique_lock<std::mutex> guard(growing_);
    const int first = 1 + count_.load();
    // Where OpenMP binds threads, this one has the place of the one that wanted a team.
    const int idle = omp_get_proc_bind() != omp_proc_bind_false;
    const int size = countThreads(std::min(wanted_.load(), most_) - first + idle);
    if (size <= idle) return static_cast<void>(starting_.fetch_sub(1));
    starting_.fetch_add(size - 1);
#pragma omp parallel num_threads(size)
    {
      const int number = omp_get_thread_num();
      if (number == 0) {
        count_.fetch_add(omp_get_num_threads() - idle);
        guard.unlock();
        starting_.fetch_sub(size - omp_get_num_threads());
      }
      starting_.fetch_sub(1);
      while (number < idle) std::this_thread::sleep_for(std::chrono::hours(1));
      serve(first + number - idle);
    }
  }
  // The life of a worker. While it has nothing to do it gives way to all else that could run on its
  // core: so it comes late, rather than being interrupted with a member in its hands.
  [[noreturn]] void serve(int thread) {
    for (Clock::time_point end = Clock::now();;) {
      const std::uint32_t seen = opened_.load();
      const auto isDue = [&] { return opened_.load() != seen; };
      for (Job& job : jobs_)
        if (job.help(thread, sleepers_)) end = Clock::now() + longest_watch;
      while (!isDue()) {
        if (Clock::now() < end) {
          std::this_thread::yield();
        } else {
          sleepers_[thread].sleep(isDue);
          end = Clock::now() + longest_watch;
        }
      }
    }
  }

  // More than passes between two regions of a frame. A round number: two or ten times as long made
  // no difference on 16 cores.
  static constexpr std::chrono::microseconds longest_watch{500};

  Job jobs_[8];  // where more spaces collide at once than that, cores are short anyway
  alignas(64) std::atomic<std::uint32_t> opened_{0};  // jobs, ever
  Sleeper sleepers_[most_threads];
  std::atomic<int> wanted_{1}, count_{0}, starting_{0};  // threads
  std::atomic<bool> closed_{false};
  std::mutex growing_;
  int most_ = 1;  // threads, the calling one among them, for which there is address space
};

}  // namespace

int threadsToBeHad(int wanted) {
  // A team within a team has one thread.
  if (teamsAreLost() || team_member.team > 1 ||
      omp_get_active_level() >= omp_get_max_active_levels())
    return 1;
  wanted = std::min({wanted, most_threads, omp_get_thread_limit()});
  return wanted > 1 ? Workers::get().granted(wanted) : 1;
}

bool shareMembers(Region& region, const Members& members) {
  return Workers::get().share(region, members);
}

// Nothing here orders what threads do: a sanitizer is to see all that they do at once.
void awaitTeam(std::atomic<int>& arrived, bool first) {
  const int team = team_member.team;
  if (team == 1) return;
  if (first) {
    arrived.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  constexpr std::chrono::milliseconds longest_wait(100);
  if (arrived.load(std::memory_order_relaxed) >= team) return;
  const Clock::time_point end = Clock::now() + longest_wait;
  while (arrived.load(std::memory_order_relaxed) < team && Clock::now() < end)
    std::this_thread::yield();
  if (arrived.load(std::memory_order_relaxed) < team)
    arrived.fetch_add(team, std::memory_order_relaxed);  // nobody waits again
}

}  // namespace ode_parallel_sap
