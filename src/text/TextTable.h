#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "depthservo/api.h"
#include "text/TextFile.h"

namespace depthservo::detail {

/// Reads a text table row by row; every fault is an InputError with file, line and column.
///
/// Lines that are blank or start with '#' are skipped; lines may end in CRLF. Every row has exactly
/// the given columns. A csv table begins with a header that names them. A `spaces` table (TUM
/// style) needs none, but a comment or a first line that names the columns (or the components x, y,
/// z, w of position and quaternion) in another order is a fault; its lines may also be separated by
/// commas or semicolons. A `euroc`
/// table begins with a header after '#', units in brackets, that may have more columns, which every
/// row has too; its times are whole nanoseconds.
///
///     TextTable table(path, TextTable::Style::csv, {"timestamp", "id", "Z"});
///     while (table.next()) use(table.time(), table.id(1), table.number(2, {0, 100}, "m"));
class DEPTHSERVO_INNER TextTable {
 public:
  enum class Style { csv, spaces, euroc };
  enum class Order { increasing, notDecreasing };  ///< of the timestamps, column 0

  TextTable(std::string path, Style style, std::vector<std::string> columns,
            Order order = Order::increasing);

  /// Goes to the next row; false after the last. A table without rows is a fault.
  bool next();

  double time() const { return time_s_; }    ///< of this row [s]
  double seconds(std::size_t column) const;  ///< another time
  double number(std::size_t column, const Range& range, const char* unit) const;
  bool hasBlanks() const { return separators_[0] == ' '; }  ///< between the fields of this row
  bool isNaN(std::size_t column) const;                     ///< it says "nan", in any spelling
  int id(std::size_t column) const;
  std::string_view text(std::size_t column) const { return fields_[column]; }
  std::size_t columns() const { return columns_.size(); }  ///< that were asked for

  [[noreturn]] void fail(std::size_t column, const std::string& message) const;

 private:
  bool nextLine();
  void split();
  void split(std::string_view text);
  void checkHeader();
  void checkEurocHeader();
  bool isHeader() const;
  void checkComment(std::string_view comment);
  void readTime();

  std::string path_, bytes_;
  Style style_;
  std::vector<std::string> columns_;
  Order order_;
  std::size_t position_ = 0;  // of the next line in bytes_
  int line_ = 0;
  std::string_view content_;  // of this line
  const char* separators_ = ",";
  std::vector<std::string_view> fields_;
  std::size_t width_;  // columns of every row
  bool hasRow_ = false;
  double time_s_ = 0;
};

}  // namespace depthservo::detail
