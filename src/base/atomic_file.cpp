#include "laban/base/atomic_file.h"

#include <cerrno>
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

/// A file written aside; removed unless it has been renamed into place.
class AsideFile {
 public:
  explicit AsideFile(const fs::path& target)
      : target_(target), name_(target.string() + ".XXXXXX"), file_(::mkstemp(name_.data())) {
    if (file_.get() < 0) fail(target_, "cannot be written: " + reason());
  }
  AsideFile(const AsideFile&) = delete;
  AsideFile& operator=(const AsideFile&) = delete;
  ~AsideFile() {
    if (!placed_) ::unlink(name_.c_str());
  }

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(target_, "cannot be written: " + reason());
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    const mode_t mask = ::umask(0);
    ::umask(mask);
    if (::fchmod(file_.get(), 0666 & ~mask) != 0 || ::fsync(file_.get()) != 0) {
      fail(target_, "cannot be written: " + reason());
    }
  }

  void place() {
    if (::rename(name_.c_str(), target_.c_str()) != 0)
      fail(target_, "cannot be written: " + reason());
    placed_ = true;
  }

 private:
  fs::path target_;
  std::string name_;
  Descriptor file_;
  bool placed_ = false;
};

}  // namespace

void check_writable(const fs::path& path, const WriteFileOptions& options) {
  std::error_code ignored;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    fail(path,
         "cannot be written: the folder " + folder.string() + " does not exist; create it first");
  }
  if (::access(folder.c_str(), W_OK) != 0) {
    fail(path, "cannot be written: the folder " + folder.string() + " is not writable");
  }
  if (fs::is_directory(path, ignored)) fail(path, "cannot be written: it is a folder; name a file");
  if (!options.overwrite && fs::exists(path, ignored)) {
    fail(path, "exists already; give --force to overwrite it");
  }
}

void write_file(const fs::path& path, std::string_view bytes, const WriteFileOptions& options) {
  check_writable(path, options);
  AsideFile aside(path);
  aside.write(bytes);
  aside.place();
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
