#include <gtest/gtest.h>

#include <algorithm>
#include <new>
#include <stdexcept>
#include <string>

#include "depthservo/text/InputError.h"
#include "failure.h"

namespace depthservo {
namespace {

template <class Failure>
int codeOf(const Failure& failure, std::string& words) {
  testing::internal::CaptureStderr();
  const int code = tellFailure(std::make_exception_ptr(failure));
  words = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(words.begin(), words.end(), '\n'), 1) << words;
  return code;
}

TEST(Failure, of_the_input_is_2_and_any_other_is_70) {
  std::string words;
  EXPECT_EQ(codeOf(InputError({"file", 3, "key"}, "is wrong"), words), 2);
  EXPECT_EQ(words, "file:3: key: is wrong\n");
  EXPECT_EQ(codeOf(std::bad_alloc(), words), 70);
  EXPECT_EQ(words, "depthservo: internal error: out of memory\n");
  EXPECT_EQ(codeOf(std::logic_error("not an estimator"), words), 70);
  EXPECT_EQ(words, "depthservo: internal error: not an estimator\n");
  EXPECT_EQ(codeOf(std::runtime_error("broken"), words), 70);
  EXPECT_EQ(codeOf(42, words), 70);
}

}  // namespace
}  // namespace depthservo
