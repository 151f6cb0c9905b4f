#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

/// SQLite's databases, read and left as they are. They are taken for hostile: views are no tables.
namespace terracast::validate {

/// A row of a query; columns from 0.
class SqliteRow {
 public:
  explicit SqliteRow(sqlite3_stmt* statement) : statement_(statement) {}
  std::int64_t integer(int column) const;
  double number(int column) const;
  bool is_null(int column) const;
  std::string text(int column) const;
  /// Numbers of a blob as they lie there; what is left of a part of one is left out.
  template <class Number>
  std::vector<Number> numbers(int column) const {
    std::vector<Number> values(num_bytes(column) / sizeof(Number));
    if (!values.empty()) std::memcpy(values.data(), blob(column), values.size() * sizeof(Number));
    return values;
  }
  std::size_t num_bytes(int column) const;

 private:
  const void* blob(int column) const;
  sqlite3_stmt* statement_;
};

class SqliteDatabase {
 public:
  /// name    of the file, for messages
  /// throws  Input: no database
  static SqliteDatabase of_bytes(std::vector<std::byte> bytes, const std::string& name);
  static SqliteDatabase of_file(const std::filesystem::path& file, const std::string& name);

  /// throws  Input: a damaged database, or one without such tables and columns; a view in place of a table; more than
  ///         2^24 rows
  void each_row(const std::string& sql, const std::function<void(const SqliteRow&)>& visit) const;

 private:
  explicit SqliteDatabase(std::string name) : name_(std::move(name)) {}
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  void check(int status) const;

  std::vector<std::byte> bytes_;
  std::string name_;
  std::unique_ptr<sqlite3, Close> handle_;
};

}  // namespace terracast::validate
