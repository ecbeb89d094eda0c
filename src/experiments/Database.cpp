#include "experiments/Database.h"

#include <sqlite3.h>

#include <cmath>

#include "depthservo/text/InputError.h"

namespace depthservo {

void Database::Close::operator()(sqlite3* database) const { sqlite3_close(database); }
void Database::Statement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

Database::Database(const std::filesystem::path& file, Open how) : file_(file) {
  // For reading, too: what a crash has left is undone then. A file that is write-protected is
  // opened all the same.
  const int flags = SQLITE_OPEN_READWRITE | (how == Open::anew ? SQLITE_OPEN_CREATE : 0);
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(file.c_str(), &opened, flags, nullptr);
  database_.reset(opened);
  if (result != SQLITE_OK) fail();
  if (how == Open::read) return;
  // A rollback journal beside the file: what a crash has left there is undone when it is opened.
  execute("PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=DELETE; PRAGMA synchronous=FULL;"
          "BEGIN EXCLUSIVE; COMMIT");
}

void Database::fail() const {
  const int code = sqlite3_errcode(database_.get());
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED) {
    throw InputError({file_.string(), 0, ""}, "another depthservo is working on it; wait for it");
  }
  throw InputError({file_.string(), 0, ""},
                   std::string("cannot be used: ") + sqlite3_errmsg(database_.get()));
}

void Database::execute(const std::string& sql) const {
  if (sqlite3_exec(database_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

Database::Statement Database::prepare(const std::string& sql) const {
  sqlite3_stmt* prepared = nullptr;
  const int result = sqlite3_prepare_v2(database_.get(), sql.c_str(),
                                        static_cast<int>(sql.size()), &prepared, nullptr);
  Statement statement;
  statement.database_ = this;
  statement.statement_.reset(prepared);
  if (result != SQLITE_OK) fail();
  return statement;
}

void Database::Statement::bind(int parameter, std::int64_t value) {
  if (sqlite3_bind_int64(statement_.get(), parameter + 1, value) != SQLITE_OK) database_->fail();
}

void Database::Statement::bind(int parameter, double value) {
  const int result = std::isfinite(value)
                         ? sqlite3_bind_double(statement_.get(), parameter + 1, value)
                         : sqlite3_bind_null(statement_.get(), parameter + 1);
  if (result != SQLITE_OK) database_->fail();
}

void Database::Statement::bind(int parameter, const std::string& value) {
  if (sqlite3_bind_text(statement_.get(), parameter + 1, value.c_str(),
                        static_cast<int>(value.size()), SQLITE_TRANSIENT) != SQLITE_OK) {
    database_->fail();
  }
}

bool Database::Statement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  if (result != SQLITE_DONE) database_->fail();
  sqlite3_reset(statement_.get());
  return false;
}

std::int64_t Database::Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::optional<double> Database::Statement::number(int column) const {
  if (sqlite3_column_type(statement_.get(), column) == SQLITE_NULL) return std::nullopt;
  return sqlite3_column_double(statement_.get(), column);
}

std::string Database::Statement::text(int column) const {
  const auto* bytes = sqlite3_column_text(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return bytes ? std::string(reinterpret_cast<const char*>(bytes), size) : std::string();
}

}  // namespace depthservo
