#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

struct sqlite3;
struct sqlite3_stmt;

namespace depthservo {

/// A SQLite file. Every fault is an InputError that names it.
class Database {
 public:
  enum class Open {
    anew,   ///< the file must not exist
    write,  ///< an existing one, which nobody else may have open
    read
  };
  Database(const std::filesystem::path& file, Open how);

  void execute(const std::string& sql) const;

  /// A prepared statement. Parameters and columns count from 0.
  class Statement {
   public:
    void bind(int parameter, std::int64_t value);
    void bind(int parameter, double value);  ///< NULL where it is not finite
    void bind(int parameter, const std::string& value);
    /// To the next row; false: there is none. Then it can be bound anew.
    bool step();

    std::int64_t integer(int column) const;
    std::optional<double> number(int column) const;  ///< none: NULL
    std::string text(int column) const;

   private:
    friend class Database;
    struct Finalize {
      void operator()(sqlite3_stmt* statement) const;
    };
    const Database* database_ = nullptr;
    std::unique_ptr<sqlite3_stmt, Finalize> statement_;
  };
  Statement prepare(const std::string& sql) const;

 private:
  [[noreturn]] void fail() const;

  struct Close {
    void operator()(sqlite3* database) const;
  };
  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Close> database_;
};

}  // namespace depthservo
