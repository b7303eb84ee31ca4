#include "http.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace laban::studio {
namespace {

TEST(ParseTarget, SplitsPathAndQueryAndDecodesBoth) {
  Request request;
  parse_target("/api/a%20b/c?name=my%20walk.bvh&empty=&flag&plus=a+b", request);
  EXPECT_EQ(request.path, "/api/a b/c");
  EXPECT_EQ(request.query["name"], "my walk.bvh");
  EXPECT_EQ(request.query["empty"], "");
  EXPECT_EQ(request.query.count("flag"), 1U);
  EXPECT_EQ(request.query["plus"], "a b");
}

TEST(ParseTarget, RefusesWhatIsNoAddress) {
  for (const char* target : {"", "api", "http://evil/", "/a%2", "/a%zz", "/a%00b", "/?x=%00"}) {
    Request request;
    EXPECT_THROW(parse_target(target, request), HttpError) << target;
  }
}

TEST(ErrorResponse, HoldsOneLineOfJsonWhateverTheBytes) {
  const Response response = error_response(422, "a \"name\" \xff\n");
  EXPECT_EQ(response.status, 422U);
  EXPECT_THAT(response.body, ::testing::StartsWith("{\"error\":\"a \\\"name\\\" "));
  EXPECT_EQ(response.body.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace laban::studio
