#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/ledger.h"

namespace terracast::geo {

/// A field of a ULog topic's records, by the file's own definition of its format.
struct UlogField {
  std::string type;  ///< int8_t … uint64_t, float, double, bool, char, or another format's name
  std::size_t count = 1;  ///< of an array
  std::size_t offset = 0;
};

/// The records of a topic, by the file's own definition of their format.
struct UlogFormat {
  std::map<std::string, UlogField, std::less<>> fields;
  std::vector<std::string> order;  ///< of the fields
  bool is_laid_out = false;        ///< offsets and size are known
  std::size_t size = 0;
  std::size_t least_size = 0;  ///< without the padding at its end, which records may leave out
};

/// Where a record is in its file.
struct UlogRecord {
  std::size_t offset;
  std::size_t size;
};

class UlogFile;

/// The records of one instance of a topic, in the file's order. It lives as long as its file.
class UlogTopic {
 public:
  UlogTopic(const UlogFile& file, std::string_view name, const UlogFormat& format,
            const std::vector<UlogRecord>& records)
      : file_(&file), name_(name), format_(&format), records_(&records) {}

  std::string_view name() const { return name_; }
  std::size_t num_records() const { return records_->size(); }
  bool has_field(std::string_view field) const { return format_->fields.contains(field); }
  /// One element of a field. Doubles hold every microsecond until the year 2255.
  /// throws   Input: the field is no number, has not so many elements, or the record ends before it
  double number(std::size_t record, std::string_view field, std::size_t element = 0) const;
  /// "flight.ulg, byte 1234", where a record begins.
  std::string where(std::size_t record) const;

 private:
  const UlogFile* file_;
  std::string_view name_;
  const UlogFormat* format_;
  const std::vector<UlogRecord>* records_;
};

/// A ULog file of PX4 (versions 1 and 2): messages, each with its size and type; formats define the records of topics,
/// subscriptions number them, and data messages hold a record each.
///
/// memory   the file's bytes, and 16 a record of the topics that are kept
/// source   PX4's "ULog File Format"
class UlogFile {
 public:
  /// kept   the topics whose records will be read
  /// throws   Io: no such file
  ///          Input: no ULog, features that readers have to know and this one does not, damage (messages that contradict
  ///          themselves or others, too) without a synchronisation mark behind it; with the byte where it stands
  UlogFile(const std::filesystem::path& file, std::set<std::string, std::less<>> kept);
  UlogFile(const UlogFile&) = delete;
  UlogFile& operator=(const UlogFile&) = delete;

  /// The numbers of a topic's instances that hold records, in order.
  std::vector<int> instances(std::string_view topic) const;
  /// Nothing where it holds no record.
  std::optional<UlogTopic> topic(std::string_view name, int instance) const;

  /// Whether a field of an instance of a topic was read.
  using IsRead = std::function<bool(std::string_view topic, int instance, std::string_view field)>;
  /// Counts messages by their types and topics by their names, those that are kept by their fields.
  void count(std::span<const core::KnownName> known, const IsRead& is_read,
             core::Ledger& ledger) const;
  /// A number that describes the log, by its type and name, "uint64_t boot_time_utc_us".
  std::optional<std::uint64_t> information(std::string_view key) const;
  /// What was lost: dropouts, damage, a message that is cut off.
  const std::vector<std::string>& remarks() const { return remarks_; }

 private:
  friend class UlogTopic;
  struct Subscription {
    std::string topic;
    int instance = 0;
    std::vector<UlogRecord>* records = nullptr;  ///< null: they are not kept
    std::int64_t num_records = 0;
  };

  void read_header();
  /// The messages between two bytes.
  void read_section(std::size_t begin, std::size_t end);
  /// Whether the head of a message that ends by `end` begins here.
  bool has_message(std::size_t at, std::size_t end) const;
  /// Whether a message is rather damage before a synchronisation mark: the mark stands in it, or it is a record or of
  /// no known type, and behind it no message begins.
  bool is_doubtful(std::size_t at, std::size_t end);
  bool is_followed(std::size_t next, std::size_t end) const;
  /// throws   Contradiction: it cannot be such a message
  void take(char type, std::size_t begin, std::size_t size);
  void take_information(std::size_t begin, std::size_t size);
  void take_flags(std::size_t begin, std::size_t size);
  void take_format(std::size_t begin, std::size_t size);
  void take_subscription(std::size_t begin, std::size_t size);
  void take_data(std::size_t begin, std::size_t size);
  void take_dropout(std::size_t begin, std::size_t size);
  /// Where the next synchronisation mark begins; nothing where there is none.
  /// cost   all calls together look at each byte once, where `from` grows
  std::optional<std::size_t> next_mark(std::size_t from, std::size_t end);
  void remark_losses();

  /// The offsets of a format's fields, and its size, once.
  /// depth   of formats within formats
  std::size_t lay_out(const std::string& name, int depth);
  std::string_view text(std::size_t begin, std::size_t size) const;
  std::string at_byte(std::size_t offset) const;

  std::filesystem::path file_;
  std::vector<std::byte> bytes_;
  std::set<std::string, std::less<>> kept_;
  std::map<std::string, UlogFormat, std::less<>> formats_;
  std::map<std::uint16_t, Subscription> subscriptions_;
  std::map<std::pair<std::string, int>, std::vector<UlogRecord>> records_;
  std::array<std::int64_t, 256> num_messages_ = {};  ///< by type
  std::map<std::string, std::uint64_t, std::less<>> information_;
  std::optional<std::size_t> mark_;  ///< the first in or behind marks_from_
  std::size_t marks_from_ = 0, marks_end_ = 0;
  std::size_t num_kept_ = 0;
  std::size_t num_dropouts_ = 0, dropout_ms_ = 0, longest_dropout_ms_ = 0;
  std::size_t num_damages_ = 0, damaged_bytes_ = 0, first_damage_ = 0;
  std::size_t num_cut_off_ = 0, first_cut_off_ = 0;
  std::size_t num_without_subscription_ = 0;
  std::array<std::size_t, 3> appended_ = {};
  std::vector<std::string> remarks_;
};

}  // namespace terracast::geo
