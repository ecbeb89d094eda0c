#pragma once

#include <locale.h>

namespace depthservo {

/// While there is one, this thread writes numbers with a decimal point, whatever language the
/// program has chosen (programs with windows do; printf and std::to_string then write "1,5").
class DecimalPoint {
 public:
  DecimalPoint() : before_(uselocale(plain())) {}
  ~DecimalPoint() { uselocale(before_); }
  DecimalPoint(const DecimalPoint&) = delete;
  DecimalPoint& operator=(const DecimalPoint&) = delete;

 private:
  static locale_t plain() {
    static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
    return locale;
  }

  locale_t before_;
};

}  // namespace depthservo
