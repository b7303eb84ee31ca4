#include "laban/base/atomic_file.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "laban/base/error.h"
#include "laban/base/huge_pages.h"

namespace laban::base {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
  throw Error(ErrorKind::kIo, path.string() + ": " + what);
}

std::string reason() {
  return std::strerror(errno);
}

/// A file descriptor that closes itself.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

void write_all(int fd, std::string_view bytes, const fs::path& target) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail(target, "cannot be written: " + reason());
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

// Names of the files that are being written aside, for a signal handler. As many as threads may
// write at once; what finds no place is not removed when the process is interrupted.
constexpr std::size_t kMostUnfinished = 16;
static_assert(std::atomic<const char*>::is_always_lock_free);
std::array<std::atomic<const char*>, kMostUnfinished> unfinished_names = {};

/// Keeps a name in `unfinished_names`. The name must outlive it.
class Unfinished {
 public:
  explicit Unfinished(const char* name) {
    for (std::atomic<const char*>& place : unfinished_names) {
      const char* empty = nullptr;
      if (!place.compare_exchange_strong(empty, name)) continue;
      place_ = &place;
      return;
    }
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;
  ~Unfinished() {
    if (place_ != nullptr) place_->store(nullptr);
  }

 private:
  std::atomic<const char*>* place_ = nullptr;
};

/// Where a file is written aside: beside its target, and named so that one left behind is known.
std::string aside_name(const fs::path& target) {
  constexpr std::size_t kLongest = 240;  // of 255, to leave room for the ending
  const std::string name = target.filename().string().substr(0, kLongest);
  return (target.parent_path() / (name + ".part-XXXXXX")).string();
}

/// Permissions of the file that is to be replaced, else those of any new file.
mode_t permissions_for(const fs::path& target) {
  struct stat facts {};
  if (::stat(target.c_str(), &facts) == 0) return facts.st_mode & 0777U;
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

/// A file written aside; removed unless it has been renamed into place.
class AsideFile {
 public:
  explicit AsideFile(const fs::path& target)
      : target_(target),
        name_(aside_name(target)),
        unfinished_(name_.c_str()),
        file_(::mkstemp(name_.data())) {
    if (file_.get() < 0) fail(target_, "cannot be written: " + reason());
  }
  AsideFile(const AsideFile&) = delete;
  AsideFile& operator=(const AsideFile&) = delete;
  ~AsideFile() {
    if (!placed_ && file_.get() >= 0) ::unlink(name_.c_str());
  }

  void write(std::string_view bytes) {
    write_all(file_.get(), bytes, target_);
    if (::fchmod(file_.get(), permissions_for(target_)) != 0 || ::fsync(file_.get()) != 0) {
      fail(target_, "cannot be written: " + reason());
    }
  }

  void place(bool overwrite) {
    if (!overwrite) {
      // Not even a file that has come to be since it was looked for is lost.
      placed_ =
          ::renameat2(AT_FDCWD, name_.c_str(), AT_FDCWD, target_.c_str(), RENAME_NOREPLACE) == 0;
      if (!placed_ && errno == EEXIST)
        fail(target_, "exists already; give --force to overwrite it");
      // Any other failure: a file system that does not know this.
    }
    if (!placed_ && ::rename(name_.c_str(), target_.c_str()) != 0) {
      fail(target_, "cannot be written: " + reason());
    }
    placed_ = true;
    sync_folder();
  }

 private:
  /// So that the new name outlives a power failure. Not all file systems can, and the file is
  /// there.
  void sync_folder() const {
    const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
    const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (opened.get() >= 0) ::fsync(opened.get());
  }

  fs::path target_;
  std::string name_;
  Unfinished unfinished_;
  Descriptor file_;
  bool placed_ = false;
};

/// True for what takes bytes but is no file to be replaced: terminals, pipes, /dev/null.
bool is_stream(const fs::path& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  return fs::is_character_file(status) || fs::is_fifo(status);
}

void write_stream(const fs::path& path, std::string_view bytes) {
  const Descriptor stream(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (stream.get() < 0) fail(path, "cannot be written: " + reason());
  write_all(stream.get(), bytes, path);
}

/// The file that a link leads to, there or not; else the path itself.
fs::path behind_links(const fs::path& path) {
  std::error_code failed;
  if (!fs::is_symlink(path, failed)) return path;
  fs::path target = fs::weakly_canonical(path, failed);
  if (failed) fail(path, "cannot be written: " + failed.message());
  return target;
}

void check_target(const fs::path& path, const WriteFileOptions& options) {
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    fail(path,
         "cannot be written: the folder " + folder.string() + " does not exist; create it first");
  }
  if (fs::is_directory(path, ignored)) fail(path, "cannot be written: it is a folder; name a file");
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    fail(path, "cannot be written: it is neither a file nor a pipe; name a file");
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    fail(path, "cannot be written: the folder " + folder.string() + " is not writable");
  }
  if (!options.overwrite && fs::exists(path, ignored)) {
    fail(path, "exists already; give --force to overwrite it");
  }
}

}  // namespace

void check_writable(const fs::path& path, const WriteFileOptions& options) {
  if (!is_stream(path)) return check_target(behind_links(path), options);
  if (::access(path.c_str(), W_OK) != 0) fail(path, "cannot be written: " + reason());
}

void write_file(const fs::path& path, std::string_view bytes, const WriteFileOptions& options) {
  if (is_stream(path)) return write_stream(path, bytes);
  const fs::path target = behind_links(path);
  check_target(target, options);
  AsideFile aside(target);
  aside.write(bytes);
  aside.place(options.overwrite);
}

void remove_unfinished_files() noexcept {
  for (const std::atomic<const char*>& place : unfinished_names) {
    const char* const name = place.load();
    if (name != nullptr) ::unlink(name);
  }
}

std::string read_file(const fs::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) fail(path, "cannot be read: " + reason());
  struct stat facts {};
  if (::fstat(file.get(), &facts) != 0) fail(path, "cannot be read: " + reason());
  if (S_ISDIR(facts.st_mode)) fail(path, "cannot be read: it is a folder; name a file");
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(facts.st_size));
  prefer_huge_pages(bytes.data(), bytes.capacity());
  char block[1 << 16];
  while (true) {
    const ssize_t count = ::read(file.get(), block, sizeof block);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "cannot be read: " + reason());
    if (count == 0) return bytes;
    bytes.append(block, static_cast<std::size_t>(count));
  }
}

}  // namespace laban::base
