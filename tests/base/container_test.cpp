#include "laban/base/container.h"

#include <gtest/gtest.h>

#include "laban/base/error.h"

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
