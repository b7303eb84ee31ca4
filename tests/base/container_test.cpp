#include "laban/base/container.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "laban/base/error.h"
#include "laban/base/sha256.h"

namespace laban::base {
namespace {

Container example() {
  return {"laban.test",
          2,
          R"({"schema":"laban.test/2"})",
          {{"a", {2, 3, {1, 2, 3, 4, 5, 6}}}, {"none", {0, 4, {}}}}};
}

std::string message_of(std::string_view bytes, std::string_view kind = "laban.test",
                       int version = 2) {
  try {
    (void)read_container(bytes, "x.laban", kind, version);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kFormat);
    return error.what();
  }
  return "read";
}

TEST(Container, ReadsBackWhatItWrote) {
  const Container back = read_container(write_container(example()), "x", "laban.test", 2);
  EXPECT_EQ(back.header_json, example().header_json);
  EXPECT_EQ(back.version, 2);
  EXPECT_EQ(back.array("a").values, example().array("a").values);
  EXPECT_EQ(back.array("none").cols, 4);
  EXPECT_EQ(write_container(back), write_container(example()));
}

TEST(Container, EveryFlippedByteIsRefused) {
  const std::string bytes = write_container(example());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    EXPECT_NE(message_of(damaged), "read") << "byte " << i;
  }
}

TEST(Container, EveryTruncationIsRefused) {
  const std::string bytes = write_container(example());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(message_of(std::string_view(bytes).substr(0, size)), "read") << size << " bytes";
  }
}

TEST(Container, ANewerVersionIsRefusedByNumber) {
  EXPECT_EQ(message_of(write_container(example()), "laban.test", 1),
            "x.laban: its format version is 2, this laban reads up to 1; update laban or train the "
            "model again");
}

TEST(Container, AVersionThatNeverWasIsRefusedByNumber) {
  std::string bytes = write_container(example());
  bytes[40] = 0;  // the version, after magic and kind; it is looked at before the checksum
  EXPECT_EQ(message_of(bytes),
            "x.laban: its format version is 0, this laban reads up to 2; update laban or train the "
            "model again");
}

TEST(Container, AnOlderVersionIsGivenToTheCaller) {
  EXPECT_EQ(read_container(write_container(example()), "x", "laban.test", 7).version, 2);
}

/// The bytes with a checksum that is right again.
std::string sealed(std::string bytes) {
  bytes.resize(bytes.size() - 64);
  return bytes + sha256_hex(bytes);
}

// Files made to harm: the checksum is right, the sizes are not. None may cost memory.
TEST(Container, SizesBeyondTheFileAreRefusedWhateverTheChecksumSays) {
  const std::string bytes = write_container(example());
  const std::size_t arrays_at = 8 + 32 + 4 + 4 + 8 + example().header_json.size();
  struct Change {
    std::size_t at;
    std::string bytes;
    std::string message;
  };
  const std::string most(4, '\xff');
  const std::vector<Change> changes = {
      {44, most, "it ends inside an array's name"},         // array count
      {48, most + most, "it ends inside its header"},       // header size
      {48, std::string(8, '\0'), "x.laban: it "},           // none: what follows is read wrongly
      {arrays_at, most, "it ends inside an array's name"},  // name size
      {arrays_at + 5, most, "has an impossible size"},      // rows
      {arrays_at + 9, most, "has an impossible size"},      // cols
      {arrays_at + 5, std::string("\xff\xff\xff\x0f\xff\xff\xff\x0f"), "it ends inside an array"},
      {arrays_at + 5, std::string("\1\0\0\0", 4), "x.laban: it "},
      {44, std::string("\1\0\0\0", 4), "it has bytes after its last array"},
      {arrays_at + 5, std::string("\0\0\0\0\xff\xff\xff\x7f", 8), "x.laban: it "},
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(change.message);
    std::string harmful = bytes;
    harmful.replace(change.at, change.bytes.size(), change.bytes);
    EXPECT_THAT(message_of(sealed(harmful)), ::testing::HasSubstr(change.message));
  }
}

TEST(Container, AHeaderBeyondAllNeedIsRefused) {
  Container container = example();
  container.header_json.assign((std::size_t{8} << 20U) + 1, ' ');
  EXPECT_EQ(message_of(write_container(container)), "x.laban: its header is larger than 8 MB");
}

TEST(Container, AnArrayThatIsThereTwiceIsRefused) {
  Container container = example();
  container.arrays["b"] = {1, 1, {0.0}};
  std::string bytes = write_container(container);
  const std::size_t at = bytes.find("b\1");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'a';
  EXPECT_EQ(message_of(sealed(bytes)), "x.laban: array 'a' is there twice");
}

TEST(Container, AnotherKindIsRefusedByName) {
  EXPECT_EQ(message_of(write_container(example()), "laban.style"),
            "x.laban: it holds 'laban.test', not 'laban.style'");
}

TEST(Container, AValueThatIsNotFiniteIsRefused) {
  Container container = example();
  container.arrays["a"].values[1] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(message_of(write_container(container)),
            "x.laban: array 'a' holds a value that is not finite");
}

}  // namespace
}  // namespace laban::base
