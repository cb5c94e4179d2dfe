#include "space/trace/trace_file.h"

#include <ode/ode.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "space/trace/trace_format.h"

namespace ode_parallel_sap {

namespace {

std::uint64_t wordAt(const unsigned char* bytes) {
  std::uint64_t word = 0;
  for (int i = 7; i >= 0; --i) word = word << 8 | bytes[i];
  return word;
}

void putTag(TraceBytes& bytes, const char* tag) {
  bytes.put64(wordAt(reinterpret_cast<const unsigned char*>(tag)));
}

std::uint64_t checksumOf(const TraceBytes& head, const TraceBytes& contents) {
  std::uint64_t checksum = trace_format::checksum_begin;
  for (const TraceBytes* bytes : {&head, &contents})
    for (std::size_t i = 0; i < bytes->size(); i += 8)
      checksum = trace_format::addToChecksum(checksum, wordAt(bytes->data() + i));
  return checksum;
}

// "e": programs that this one starts do not get the file.
#if defined(__GLIBC__)
constexpr char write_mode[] = "wbe";  // fixed: the C library's
#else
constexpr char write_mode[] = "wb";  // fixed: the C library's
#endif

}  // namespace

bool TraceFile::open(const std::string& path) {
  path_ = path;
  whole_ = 0;
  errno = 0;
  file_.reset(std::fopen(path.c_str(), write_mode));
  if (!file_) {
    dMessage(0, "parallel SAP space: the trace %s cannot be written: %s", path.c_str(),
             std::strerror(errno));
    return false;
  }
  head_.clear();
  putTag(head_, trace_format::magic);
  if (!put(head_)) {
    giveUp(std::strerror(errno));
    return false;
  }
  whole_ = head_.size();
  return true;
}

void TraceFile::write(const char (&tag)[9], TraceBytes& contents) {
  if (!file_) return;
  contents.pad();
  head_.clear();
  putTag(head_, tag);
  head_.put64(contents.size());
  head_.put64(checksumOf(head_, contents));
  if (!put(head_) || !put(contents)) return giveUp(std::strerror(errno));
  whole_ += head_.size() + contents.size();
}

// Chunks reach the file as they are written, so that those of a program that crashes are there.
bool TraceFile::put(const TraceBytes& bytes) {
  errno = 0;
  return std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) == bytes.size() &&
         std::fflush(file_.get()) == 0;
}

void TraceFile::giveUp(const char* why) {
  if (!file_) return;
  dMessage(0, "parallel SAP space: the trace %s ends here: %s", path_.c_str(), why);
  // Of the file itself, since another one may have its name by now; when what closing it would
  // write is written.
  const int file = dup(fileno(file_.get()));
  file_.reset();
  if (file < 0) return;
  struct stat about;
  if (fstat(file, &about) == 0 && S_ISREG(about.st_mode) &&
      ftruncate(file, static_cast<off_t>(whole_)) != 0)
    dMessage(0, "parallel SAP space: the trace %s cannot be cut: %s", path_.c_str(),
             std::strerror(errno));
  close(file);
}

}  // namespace ode_parallel_sap
