#include <gtest/gtest.h>

#include "depthservo/text/InputError.h"
#include "support/InputErrors.h"

namespace depthservo {
namespace {

using test::isRefusal;

TEST(InputErrorTest, tells_file_line_key_and_message) {
  const InputError error({"a/b.yaml", 3, "camera.fx"}, "expected a number");
  EXPECT_STREQ(error.what(), "a/b.yaml:3: camera.fx: expected a number");
  EXPECT_EQ(error.line(), 3);
}

TEST(InputErrorTest, leaves_out_what_is_not_known) {
  EXPECT_STREQ(InputError({"b.csv", 0, ""}, "is empty").what(), "b.csv: is empty");
}

TEST(InputErrorTest, stays_one_short_line_that_ends_with_the_file_whatever_is_put_in) {
  const std::string rubbish = std::string("\n\r\x01\xff", 4) + std::string(100000, 'x');
  const InputError error({std::string(5000, 'd') + "/name.yaml", 3, rubbish}, rubbish + "\n");
  EXPECT_TRUE(isRefusal(error.what(), {"name.yaml:3:"}));
}

TEST(InputErrorTest, cuts_between_characters) {
  std::string accents;
  for (int i = 0; i < 1000; ++i) accents += "\xc3\xa9";
  for (const char* shift : {"", "x"}) {
    const std::string text = InputError({"f", 0, ""}, shift + accents).what();
    EXPECT_EQ(text.find('?'), std::string::npos);
    EXPECT_EQ(text.substr(text.size() - 5), "\xc3\xa9...");
  }
}

TEST(InputErrorTest, nearest_word_forgives_typing_errors_and_case) {
  const std::vector<std::string> valid = {"gain", "interaction", "Z_min"};
  EXPECT_EQ(nearestWord("gian", valid), "gain");
  EXPECT_EQ(nearestWord("Interactoin", valid), "interaction");
  EXPECT_EQ(nearestWord("z_min", valid), "Z_min");
}

}  // namespace
}  // namespace depthservo
