#include "text/Names.h"

#include <fmt/format.h>

#include "depthservo/text/InputError.h"
#include "text/TextFile.h"

namespace depthservo::detail {

std::string unknownWord(const std::string& word, const std::vector<std::string>& valid) {
  std::string list = valid.front();
  for (std::size_t i = 1; i < valid.size(); ++i) {
    list += (i + 1 < valid.size() ? ", " : " or ") + valid[i];
  }
  return fmt::format("expected {}, got {}; the nearest is '{}'", list, detail::quoted(word),
                     nearestWord(word, valid));
}

}  // namespace depthservo::detail
