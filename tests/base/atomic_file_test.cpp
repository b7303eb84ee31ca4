#include "laban/base/atomic_file.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/sha256.h"

namespace laban::base {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  AtomicFile() : folder_(fs::path(::testing::TempDir()) / ("laban_" + std::string(name()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~AtomicFile() override { fs::remove_all(folder_); }
  static const char* name() {
    return ::testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  [[nodiscard]] std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }
  fs::path folder_;
};

TEST_F(AtomicFile, ReadsBackWhatItWroteAndLeavesNothingElse) {
  const std::string bytes("a\0b\n", 4);
  write_file(folder_ / "x", bytes);
  EXPECT_EQ(read_file(folder_ / "x"), bytes);
  EXPECT_EQ(entries(), 1);
}

TEST_F(AtomicFile, AnExistingFileIsKeptUnlessAskedFor) {
  write_file(folder_ / "x", "old");
  try {
    write_file(folder_ / "x", "new");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_THAT(error.what(), ::testing::HasSubstr("x: exists already; give --force"));
  }
  EXPECT_EQ(read_file(folder_ / "x"), "old");
  write_file(folder_ / "x", "new", {.overwrite = true});
  EXPECT_EQ(read_file(folder_ / "x"), "new");
}

TEST_F(AtomicFile, AMissingFolderIsNamed) {
  EXPECT_THROW(write_file(folder_ / "no" / "x", "bytes"), Error);
  EXPECT_EQ(entries(), 0);
}

TEST_F(AtomicFile, AFolderIsNotAFile) {
  EXPECT_THROW((void)read_file(folder_), Error);
  EXPECT_THROW(write_file(folder_, "bytes", {.overwrite = true}), Error);
}

TEST(Sha256, MatchesThePublishedVectors) {  // FIPS 180-2, appendix B
  EXPECT_EQ(sha256_hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256_hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace laban::base
