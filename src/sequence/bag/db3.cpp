#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <optional>

#include "depthservo/text/InputError.h"
#include "sequence/bag/ChunkedBag.h"
#include "sequence/bag/unpack.h"
#include "text/TextFile.h"

namespace depthservo::detail {
namespace {

using Database = std::unique_ptr<sqlite3, decltype(&sqlite3_close)>;
using Statement = std::unique_ptr<sqlite3_stmt, decltype(&sqlite3_finalize)>;
using Blob = std::unique_ptr<sqlite3_blob, decltype(&sqlite3_blob_close)>;

/// Steps of SQLite's machine for the schema, or for all topics: about ten for each. Pages that lie
/// on their own way would take for ever.
constexpr int kMostSteps = 200'000;

/// What SQLite last had to say.
std::string wordsOf(sqlite3* database) {
  const bool isEndless = sqlite3_errcode(database) == SQLITE_INTERRUPT;
  return isEndless ? "its tables have no end" : sqlite3_errmsg(database);
}

/// The rows of a table in the order of their numbers. A damaged page can make SQLite give the same
/// row for ever.
class Rows {
 public:
  explicit Rows(sqlite3_stmt* statement) : statement_(statement) {}

  /// Goes to the next row, whose number is column 0: false after the last one, and at damage.
  bool next() {
    result_ = sqlite3_step(statement_);
    if (result_ != SQLITE_ROW) return false;
    const std::int64_t number = sqlite3_column_int64(statement_, 0);
    isInOrder_ = !number_ || number > *number_;
    number_ = number;
    return isInOrder_;
  }

  /// Why there is no next row; empty: it was the last one.
  std::string damage() const {
    if (!isInOrder_) return "its rows are not in order";
    return result_ == SQLITE_DONE ? "" : wordsOf(sqlite3_db_handle(statement_));
  }

 private:
  sqlite3_stmt* statement_;
  std::optional<std::int64_t> number_;
  bool isInOrder_ = true;
  int result_ = SQLITE_OK;
};

/// A SQLite file of rosbag2_storage: the tables `topics` and `messages`.
class Db3Bag : public Bag {
 public:
  explicit Db3Bag(const std::string& path);
  void visit(BagVisitor& visitor) override;
  std::string read(const MessagePlace& place) override;

 private:
  Statement prepare(const char* sql) const;
  void checkSize();
  void requireTables() const;
  void readTopics();
  std::string bytesOf(std::int64_t row, std::size_t most, std::uint64_t& size) const;
  [[noreturn]] void refuse(const std::string& reason) const {
    throw InputError({path_, 0, ""}, reason);
  }

  std::string path_, cut_;
  Database database_{nullptr, sqlite3_close};
  std::map<std::int64_t, std::size_t> topicOf_;
};

Db3Bag::Db3Bag(const std::string& path) : path_(path) {
  checkSize();
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(path.c_str(), &opened, SQLITE_OPEN_READONLY, nullptr);
  database_.reset(opened);
  if (result != SQLITE_OK) refuse(fmt::format("cannot be opened: {}", sqlite3_errstr(result)));
  sqlite3_db_config(opened, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(opened, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_limit(opened, SQLITE_LIMIT_LENGTH, static_cast<int>(kMostBytesHeld));
  sqlite3_exec(opened, "PRAGMA cell_size_check = ON", nullptr, nullptr, nullptr);
  sqlite3_progress_handler(
      opened, kMostSteps, [](void*) { return 1; }, nullptr);
  requireTables();
  readTopics();
  sqlite3_progress_handler(opened, 0, nullptr, nullptr);
}

Statement Db3Bag::prepare(const char* sql) const {
  sqlite3_stmt* made = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &made, nullptr) != SQLITE_OK) {
    refuse("is not a recording of ROS 2 or is damaged: " + wordsOf(database_.get()));
  }
  return {made, sqlite3_finalize};
}

/// SQLite reads a file of fewer pages than its header tells (https://sqlite.org/fileformat.html).
void Db3Bag::checkSize() {
  FileBytes file(path_);
  constexpr std::uint64_t kHeader = 100;
  if (file.size() < kHeader) refuse("is not a SQLite file or is cut off");
  const std::string header(file.at(0, kHeader));
  const auto byte = [&](std::size_t i) {
    return std::uint64_t{static_cast<unsigned char>(header[i])};
  };
  const std::uint64_t told = byte(16) << 8 | byte(17), page = told == 1 ? 65536 : told;
  const std::uint64_t pages = byte(28) << 24 | byte(29) << 16 | byte(30) << 8 | byte(31);
  if (header.compare(24, 4, header, 92, 4) == 0 && file.size() < pages * page) {
    cut_ = fmt::format("the file has {} of {} bytes (cut off?); what is whole of it is read",
                       file.size(), pages * page);
  }
}

/// Tables, not views, which may compute anything.
void Db3Bag::requireTables() const {
  const Statement tables = prepare(
      "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')");
  if (sqlite3_step(tables.get()) != SQLITE_ROW || sqlite3_column_int(tables.get(), 0) != 2) {
    refuse(
        "is not a recording of ROS 2: expected a SQLite file with the tables topics and messages");
  }
}

void Db3Bag::readTopics() {
  const Statement topics =
      prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
  const auto text = [&](int column) {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(topics.get(), column));
    return std::string(bytes ? bytes : "");
  };
  Rows rows(topics.get());
  while (rows.next()) {
    BagTopic topic;
    topic.name = printable(text(1));
    topic.type = printable(plainType(text(2)));
    const std::string encoding = text(3);
    if (encoding != "cdr") {
      topic.fault = fmt::format("is encoded as {}, expected cdr", detail::quoted(encoding));
    }
    topicOf_[sqlite3_column_int64(topics.get(), 0)] = topics_.size();
    topics_.push_back(std::move(topic));
  }
  if (!rows.damage().empty()) refuse("is damaged: " + rows.damage());
}

/// The first bytes of a message, unpacked where recordings pack every message.
std::string Db3Bag::bytesOf(std::int64_t row, std::size_t most, std::uint64_t& size) const {
  sqlite3_blob* opened = nullptr;
  const int result =
      sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &opened);
  const Blob blob(opened, sqlite3_blob_close);
  if (result != SQLITE_OK) throw BagFault(wordsOf(database_.get()));
  size = static_cast<std::uint64_t>(sqlite3_blob_bytes(opened));
  const auto readBytes = [&](std::uint64_t count) {
    std::string bytes(static_cast<std::size_t>(count), '\0');
    if (sqlite3_blob_read(opened, bytes.data(), static_cast<int>(count), 0) != SQLITE_OK) {
      throw BagFault(wordsOf(database_.get()));
    }
    return bytes;
  };
  std::string bytes = readBytes(std::min<std::uint64_t>(size, most));
  if (!isZstd(bytes)) return bytes;
  if (bytes.size() < size) bytes = readBytes(size);
  const auto unpacked = unpack(bytes, "zstd", zstdSize(bytes));
  size = unpacked->size();
  return std::string(unpacked->at(0, std::min<std::uint64_t>(size, most)));
}

void Db3Bag::visit(BagVisitor& visitor) {
  const Statement messages =
      prepare("SELECT rowid, topic_id, timestamp FROM messages ORDER BY rowid");
  std::size_t unread = 0;
  std::string reason;
  const auto leaveOut = [&](const std::string& why) {
    if (unread++ == 0) reason = why;
  };
  Rows rows(messages.get());
  while (rows.next()) {
    const std::int64_t row = sqlite3_column_int64(messages.get(), 0);
    const auto topic = topicOf_.find(sqlite3_column_int64(messages.get(), 1));
    if (topic == topicOf_.end()) {
      leaveOut("it is of no topic");
      continue;
    }
    const std::size_t wanted = visitor.wanted(topics_[topic->second]);
    if (wanted == 0) continue;
    BagMessage message;
    message.topic = topic->second;
    message.received_ns = sqlite3_column_int64(messages.get(), 2);
    message.place.offset = static_cast<std::uint64_t>(row);
    try {
      const std::string bytes = bytesOf(row, wanted, message.place.size);
      message.bytes = bytes;
      visitor.visit(message);
    } catch (const BagFault& fault) {
      leaveOut(fault.what());
    }
  }
  warnings_.clear();
  if (!cut_.empty()) warnings_.push_back(cut_);
  if (!rows.damage().empty()) {
    warnings_.push_back(fmt::format(
        "the file is cut off or damaged ({}); what is whole before it is read", rows.damage()));
  }
  if (unread > 0) {
    warnings_.push_back(
        fmt::format("{} messages are damaged and left out, the first: {}", unread, reason));
  }
}

std::string Db3Bag::read(const MessagePlace& place) {
  std::uint64_t size = 0;
  return bytesOf(static_cast<std::int64_t>(place.offset), static_cast<std::size_t>(kMostBytesHeld),
                 size);
}

}  // namespace

std::unique_ptr<Bag> openDb3(const std::string& path) { return std::make_unique<Db3Bag>(path); }

}  // namespace depthservo::detail
