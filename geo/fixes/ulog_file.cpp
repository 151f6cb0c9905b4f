#include "geo/fixes/ulog_file.h"

#include <algorithm>
#include <charconv>

#include "core/error.h"
#include "geo/fixes/binary.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kMessageHeaderSize = 3;
constexpr std::string_view kTypes = "ABCDFILMOPQRS";
constexpr std::array<unsigned char, 7> kMagic = {'U', 'L', 'o', 'g', 0x01, 0x12, 0x35};
/// A synchronisation mark whole: its size, its type, and eight bytes that stand nowhere else.
constexpr std::array<unsigned char, 11> kMark = {8,    0,    'S',  0x2F, 0x73, 0x13,
                                                 0x20, 0x25, 0x0C, 0xBB, 0x12};
// A record's size is counted in 16 bits. PX4 has some 300 formats, of up to 300 fields.
constexpr std::size_t kMostRecordBytes = 65535;
constexpr std::size_t kMostFormats = 2000;
constexpr std::size_t kMostFields = 1000;
constexpr int kMostNested = 16;
constexpr std::size_t kMostRecords = 8'000'000;

/// A message that contradicts itself, or those before it: damage, over which a synchronisation mark helps.
struct Contradiction {
  std::string words;
};

template <class... Parts>
[[noreturn]] void contradict(fmt::format_string<Parts...> words, Parts&&... parts) {
  throw Contradiction{fmt::format(words, std::forward<Parts>(parts)...)};
}

/// Nothing where the type is another format's name.
std::optional<std::size_t> size_of_basic(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, std::size_t>, 12> kSizes = {{{"int8_t", 1},
                                                                                {"uint8_t", 1},
                                                                                {"int16_t", 2},
                                                                                {"uint16_t", 2},
                                                                                {"int32_t", 4},
                                                                                {"uint32_t", 4},
                                                                                {"int64_t", 8},
                                                                                {"uint64_t", 8},
                                                                                {"float", 4},
                                                                                {"double", 8},
                                                                                {"bool", 1},
                                                                                {"char", 1}}};
  for (const auto& [name, size] : kSizes)
    if (name == type) return size;
  return std::nullopt;
}

bool is_word(std::string_view text, std::string_view more) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           more.find(c) != std::string_view::npos;
  });
}

/// "float[4] q" as its name and the field; nothing where the text is another.
std::optional<std::pair<std::string, UlogField>> field_of(std::string_view text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string_view::npos) return std::nullopt;
  std::string_view type = text.substr(0, blank);
  const std::string_view name = text.substr(blank + 1);
  UlogField field;
  if (type.ends_with(']')) {
    const std::size_t bracket = type.find('[');
    if (bracket == std::string_view::npos) return std::nullopt;
    const std::string_view digits = type.substr(bracket + 1, type.size() - bracket - 2);
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), field.count);
    if (error != std::errc() || end != digits.data() + digits.size() || field.count == 0 ||
        field.count > kMostRecordBytes)
      return std::nullopt;
    type = type.substr(0, bracket);
  }
  if (!is_word(type, "-/") || !is_word(name, "")) return std::nullopt;
  field.type = type;
  return std::pair(std::string(name), field);
}

}  // namespace

UlogFile::UlogFile(const std::filesystem::path& file, std::set<std::string, std::less<>> kept)
    : file_(file), bytes_(bytes_of_recording(file)), kept_(std::move(kept)) {
  read_header();
  std::size_t begin = kHeaderSize;
  for (std::size_t section = 0; section <= appended_.size(); ++section) {
    // Flags, the first message, say where appended sections begin.
    if (section == 0 && bytes_.size() >= kHeaderSize + kMessageHeaderSize &&
        number_at<char>(bytes_, kHeaderSize + 2) == 'B') {
      const std::size_t size = number_at<std::uint16_t>(bytes_, kHeaderSize);
      if (size <= bytes_.size() - kHeaderSize - kMessageHeaderSize) {
        take_flags(kHeaderSize + kMessageHeaderSize, size);
        begin += kMessageHeaderSize + size;
        ++num_messages_['B'];
      }
    }
    const bool is_last = section == appended_.size() || appended_[section] == 0;
    const std::size_t end = is_last ? bytes_.size() : appended_[section];
    if (end < begin || end > bytes_.size())
      fail(ErrorKind::Input,
           "{}: appended data is said to begin at byte {}, which is not between bytes {} and {}",
           at_byte(kHeaderSize), end, begin, bytes_.size());
    read_section(begin, end);
    if (is_last) break;
    begin = end;
  }
  for (const auto& [key, records] : records_) lay_out(key.first, 0);
  remark_losses();
}

void UlogFile::read_header() {
  const bool is_ulog = bytes_.size() >= kMagic.size() &&
                       std::equal(kMagic.begin(), kMagic.end(), bytes_.begin(),
                                  [](unsigned char a, std::byte b) { return std::byte{a} == b; });
  if (!is_ulog)
    fail(ErrorKind::Input,
         "{}: it does not begin as a ULog does, with \"ULog\" and the bytes 01 12 35",
         file_.string());
  if (bytes_.size() < kHeaderSize)
    fail(ErrorKind::Input, "{}: it ends after {} bytes, within the header of {}", file_.string(),
         bytes_.size(), kHeaderSize);
}

bool UlogFile::has_message(std::size_t at, std::size_t end) const {
  if (end - at < kMessageHeaderSize) return false;
  const char type = number_at<char>(bytes_, at + 2);
  return is_word(std::string_view(&type, 1), "") &&
         number_at<std::uint16_t>(bytes_, at) <= end - at - kMessageHeaderSize;
}

bool UlogFile::is_followed(std::size_t next, std::size_t end) const {
  if (next == end) return true;
  if (!has_message(next, end)) return false;
  const auto is_known = [&](std::size_t at) {
    return kTypes.find(number_at<char>(bytes_, at + 2)) != std::string_view::npos;
  };
  if (is_known(next)) return true;
  const std::size_t second = next + kMessageHeaderSize + number_at<std::uint16_t>(bytes_, next);
  return second == end || (has_message(second, end) && is_known(second));
}

bool UlogFile::is_doubtful(std::size_t at, std::size_t end) {
  const std::optional<std::size_t> mark = next_mark(at + 1, end);
  if (!mark) return false;
  const std::size_t next = at + kMessageHeaderSize + number_at<std::uint16_t>(bytes_, at);
  if (*mark < next) return true;
  const char type = number_at<char>(bytes_, at + 2);
  const bool may_be_shifted = type == 'D' || kTypes.find(type) == std::string_view::npos;
  return may_be_shifted && !is_followed(next, end);
}

void UlogFile::read_section(std::size_t begin, std::size_t end) {
  std::size_t at = begin;
  while (at < end) {
    std::string contradiction;
    if (has_message(at, end) && !is_doubtful(at, end)) {
      const std::size_t size = number_at<std::uint16_t>(bytes_, at);
      try {
        take(number_at<char>(bytes_, at + 2), at + kMessageHeaderSize, size);
        at += kMessageHeaderSize + size;
        continue;
      } catch (const Contradiction& found) {
        contradiction = found.words;
      }
    }
    if (const std::optional<std::size_t> mark = next_mark(at + 1, end)) {
      if (num_damages_++ == 0) first_damage_ = at;
      damaged_bytes_ += *mark - at;
      at = *mark;
      continue;
    }
    if (!contradiction.empty())
      fail(ErrorKind::Input, "{}; no synchronisation mark follows: the log is damaged",
           contradiction);
    const char type = end - at >= kMessageHeaderSize ? number_at<char>(bytes_, at + 2) : 'D';
    if (!is_word(std::string_view(&type, 1), ""))
      fail(ErrorKind::Input,
           "{}: no message begins here (its type would be {:#04x}, not a letter), and no "
           "synchronisation mark follows: the log is damaged",
           at_byte(at), static_cast<unsigned char>(type));
    if (num_cut_off_++ == 0) first_cut_off_ = at;
    return;
  }
}

void UlogFile::take(char type, std::size_t begin, std::size_t size) {
  switch (type) {
    case 'B':
      contradict("{}: flags; they are the first message of a log, at byte {}",
                 at_byte(begin - kMessageHeaderSize), kHeaderSize);
    case 'F':
      take_format(begin, size);
      break;
    case 'A':
      take_subscription(begin, size);
      break;
    case 'D':
      take_data(begin, size);
      break;
    case 'I':
      take_information(begin, size);
      break;
    case 'O':
      take_dropout(begin, size);
      break;
    default:  // is counted, and holds no motion
      break;
  }
  ++num_messages_[static_cast<unsigned char>(type)];
}

void UlogFile::take_flags(std::size_t begin, std::size_t size) {
  constexpr std::size_t kFlagBytes = 8, kSize = 40;
  if (size < kSize)
    fail(ErrorKind::Input, "{}: {} bytes of flags; they are {} or more", at_byte(begin), size,
         kSize);
  bool has_appended = false;
  for (std::size_t i = 0; i < kFlagBytes; ++i) {
    const auto flags = number_at<std::uint8_t>(bytes_, begin + kFlagBytes + i);
    has_appended |= i == 0 && (flags & 1) != 0;
    if ((i == 0 ? flags & ~1u : flags) != 0)
      fail(
          ErrorKind::Input,
          "{}: the flags {:#04x} name a feature that changes how the log is read, and is not known "
          "here; a newer version of the format would be",
          at_byte(begin + kFlagBytes + i), flags);
  }
  if (!has_appended) return;
  for (std::size_t i = 0; i < appended_.size(); ++i)
    appended_[i] = number_at<std::uint64_t>(bytes_, begin + 2 * kFlagBytes + 8 * i);
}

void UlogFile::take_format(std::size_t begin, std::size_t size) {
  const std::string_view whole = text(begin, size);
  const std::size_t colon = whole.find(':');
  const std::string name(whole.substr(0, std::min(colon, whole.size())));
  UlogFormat format;
  bool is_right = colon != std::string_view::npos && is_word(name, "-/");
  std::string_view rest = is_right ? whole.substr(colon + 1) : std::string_view();
  while (is_right && !rest.empty()) {
    const std::size_t end = rest.find(';');
    const auto field = field_of(rest.substr(0, end));
    is_right = field && format.order.size() < kMostFields;
    if (!is_right) break;
    if (!format.fields.try_emplace(field->first, field->second).second) {
      is_right = false;
      break;
    }
    format.order.push_back(field->first);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  if (!is_right || format.order.empty())
    contradict(
        "{}: \"{}\" defines no format; it is to be name:type field;type[count] field; with up to "
        "{} "
        "different fields",
        at_byte(begin), whole.substr(0, 80), kMostFields);
  if (formats_.size() >= kMostFormats)
    fail(ErrorKind::Input, "{}: more than {} formats", at_byte(begin), kMostFormats);
  const auto [known, is_new] = formats_.try_emplace(name, format);
  const auto is_same = [&](const std::string& field) {
    const UlogField &a = known->second.fields.at(field), &b = format.fields.at(field);
    return a.type == b.type && a.count == b.count;
  };
  if (!is_new && (known->second.order != format.order ||
                  !std::all_of(format.order.begin(), format.order.end(), is_same)))
    contradict("{}: format {} is defined a second time, otherwise than before", at_byte(begin),
               name);
}

void UlogFile::take_subscription(std::size_t begin, std::size_t size) {
  constexpr std::size_t kNameAt = 3;
  if (size <= kNameAt)
    contradict("{}: a subscription of {} bytes has no name", at_byte(begin), size);
  Subscription subscription{.topic = std::string(text(begin + kNameAt, size - kNameAt)),
                            .instance = number_at<std::uint8_t>(bytes_, begin)};
  const auto id = number_at<std::uint16_t>(bytes_, begin + 1);
  if (!formats_.contains(subscription.topic))
    contradict("{}: \"{}\" is subscribed to, and no format before defines it", at_byte(begin),
               subscription.topic.substr(0, 80));
  if (kept_.contains(subscription.topic))
    subscription.records = &records_[{subscription.topic, subscription.instance}];
  const auto [known, is_new] = subscriptions_.try_emplace(id, subscription);
  if (!is_new && (known->second.topic != subscription.topic ||
                  known->second.instance != subscription.instance))
    contradict("{}: the number {} is that of {} already, and now of {}", at_byte(begin), id,
               known->second.topic, subscription.topic);
}

void UlogFile::take_data(std::size_t begin, std::size_t size) {
  if (size < 2)
    contradict("{}: a record of {} bytes has no number of its topic", at_byte(begin), size);
  const auto found = subscriptions_.find(number_at<std::uint16_t>(bytes_, begin));
  if (found == subscriptions_.end()) {
    ++num_without_subscription_;
    return;
  }
  Subscription& subscription = found->second;
  if (subscription.records != nullptr) {
    lay_out(subscription.topic, 0);
    const UlogFormat& format = formats_.find(subscription.topic)->second;
    if (size - 2 < format.least_size || size - 2 > format.size)
      contradict("{}: a record of {} has {} bytes, and its format takes {} to {}", at_byte(begin),
                 subscription.topic, size - 2, format.least_size, format.size);
  }
  ++subscription.num_records;
  if (subscription.records == nullptr) return;
  if (++num_kept_ > kMostRecords)
    fail(ErrorKind::Input, "{}: more than {} records of places and attitudes; cut the log",
         at_byte(begin), kMostRecords);
  subscription.records->push_back({begin + 2, size - 2});
}

/// Numbers of 64 bits alone; the first of a name counts.
void UlogFile::take_information(std::size_t begin, std::size_t size) {
  constexpr std::string_view kType = "uint64_t ";
  const std::size_t key_size = size > 0 ? number_at<std::uint8_t>(bytes_, begin) : 0;
  if (size != 1 + key_size + sizeof(std::uint64_t)) return;
  const std::string_view key = text(begin + 1, key_size);
  if (key.starts_with(kType))
    information_.try_emplace(std::string(key),
                             number_at<std::uint64_t>(bytes_, begin + 1 + key_size));
}

std::optional<std::uint64_t> UlogFile::information(std::string_view key) const {
  const auto found = information_.find(key);
  return found != information_.end() ? std::optional(found->second) : std::nullopt;
}

void UlogFile::take_dropout(std::size_t begin, std::size_t size) {
  if (size < 2) contradict("{}: a dropout of {} bytes states no duration", at_byte(begin), size);
  const std::size_t duration_ms = number_at<std::uint16_t>(bytes_, begin);
  ++num_dropouts_;
  dropout_ms_ += duration_ms;
  longest_dropout_ms_ = std::max(longest_dropout_ms_, duration_ms);
}

std::optional<std::size_t> UlogFile::next_mark(std::size_t from, std::size_t end) {
  if (from >= end) return std::nullopt;
  const bool is_found = end == marks_end_ && from >= marks_from_ && (!mark_ || from <= *mark_);
  if (is_found) return mark_;
  marks_from_ = from;
  marks_end_ = end;
  const auto last = bytes_.begin() + static_cast<std::ptrdiff_t>(end);
  const auto found =
      std::search(bytes_.begin() + static_cast<std::ptrdiff_t>(from), last, kMark.begin(),
                  kMark.end(), [](std::byte a, unsigned char b) { return a == std::byte{b}; });
  mark_.reset();
  if (found != last) mark_ = static_cast<std::size_t>(found - bytes_.begin());
  return mark_;
}

void UlogFile::remark_losses() {
  if (num_dropouts_ > 0)
    remarks_.push_back(fmt::format(
        "the logger was too slow {} time{}, for {:.3f} s in all and {:.3f} s at the longest: what "
        "was to be written then is missing",
        num_dropouts_, num_dropouts_ == 1 ? "" : "s", 1e-3 * static_cast<double>(dropout_ms_),
        1e-3 * static_cast<double>(longest_dropout_ms_)));
  if (num_damages_ > 0)
    remarks_.push_back(fmt::format(
        "{} bytes in {} place{}, the first at byte {}, are damaged; reading went on at the next "
        "synchronisation mark",
        damaged_bytes_, num_damages_, num_damages_ == 1 ? "" : "s", first_damage_));
  if (num_cut_off_ > 0)
    remarks_.push_back(
        fmt::format("the message at byte {} is cut off, as where the power failed; it is left out",
                    first_cut_off_));
  if (num_without_subscription_ > 0)
    remarks_.push_back(fmt::format("{} records of topics that no subscription names are left out",
                                   num_without_subscription_));
}

std::size_t UlogFile::lay_out(const std::string& name, int depth) {
  const auto found = formats_.find(name);
  if (found == formats_.end())
    fail(ErrorKind::Input, "{}: a format holds a {}, which is neither a number nor a format",
         file_.string(), name.substr(0, 80));
  UlogFormat& format = found->second;
  if (format.is_laid_out) return format.size;
  if (depth > kMostNested)
    fail(ErrorKind::Input, "{}: format {} holds itself, or formats are nested {} deep",
         file_.string(), name, depth);
  std::size_t offset = 0;
  for (const std::string& field_name : format.order) {
    UlogField& field = format.fields.at(field_name);
    field.offset = offset;
    const auto basic = size_of_basic(field.type);
    offset += field.count * (basic ? *basic : lay_out(field.type, depth + 1));
    if (offset > kMostRecordBytes)
      fail(ErrorKind::Input, "{}: a record of format {} would have more than {} bytes",
           file_.string(), name, kMostRecordBytes);
  }
  format.is_laid_out = true;
  format.size = format.least_size = offset;
  for (auto field = format.order.rbegin();
       field != format.order.rend() && field->starts_with("_padding"); ++field)
    format.least_size = format.fields.find(*field)->second.offset;
  return offset;
}

std::vector<int> UlogFile::instances(std::string_view topic) const {
  std::vector<int> result;
  for (const auto& [key, records] : records_)
    if (key.first == topic && !records.empty()) result.push_back(key.second);
  return result;
}

std::optional<UlogTopic> UlogFile::topic(std::string_view name, int instance) const {
  const auto found = records_.find({std::string(name), instance});
  if (found == records_.end() || found->second.empty()) return std::nullopt;
  return UlogTopic(*this, found->first.first, formats_.find(name)->second, found->second);
}

double UlogTopic::number(std::size_t index, std::string_view field_name,
                         std::size_t element) const {
  const UlogRecord& record = (*records_)[index];
  const auto found = format_->fields.find(field_name);
  const bool is_there = found != format_->fields.end();
  const auto size = is_there ? size_of_basic(found->second.type) : std::nullopt;
  if (!size || element >= found->second.count)
    fail(ErrorKind::Input, "{}: the format of {} has no {}{}, which is expected", where(index),
         name_, element == 0 ? "number " : fmt::format("array of {} numbers ", element + 1),
         field_name);
  const std::size_t offset = found->second.offset + element * *size;
  if (offset + *size > record.size)
    fail(ErrorKind::Input, "{}: the record of {} has {} bytes, and ends before its {} at byte {}",
         where(index), name_, record.size, field_name, offset);
  const std::size_t at = record.offset + offset;
  const std::span<const std::byte> bytes = file_->bytes_;
  const std::string_view type = found->second.type;
  if (type == "float") return static_cast<double>(number_at<float>(bytes, at));
  if (type == "double") return number_at<double>(bytes, at);
  if (type == "int8_t" || type == "char") return number_at<std::int8_t>(bytes, at);
  if (type == "uint8_t" || type == "bool") return number_at<std::uint8_t>(bytes, at);
  if (type == "int16_t") return number_at<std::int16_t>(bytes, at);
  if (type == "uint16_t") return number_at<std::uint16_t>(bytes, at);
  if (type == "int32_t") return number_at<std::int32_t>(bytes, at);
  if (type == "uint32_t") return number_at<std::uint32_t>(bytes, at);
  if (type == "int64_t") return static_cast<double>(number_at<std::int64_t>(bytes, at));
  return static_cast<double>(number_at<std::uint64_t>(bytes, at));
}

std::string UlogTopic::where(std::size_t record) const {
  return file_->at_byte((*records_)[record].offset);
}

void UlogFile::count(std::span<const core::KnownName> known, const IsRead& is_read,
                     core::Ledger& ledger) const {
  for (std::size_t type = 0; type < num_messages_.size(); ++type)
    if (num_messages_[type] > 0)
      ledger.count(fmt::format("message {}", static_cast<char>(type)), known, num_messages_[type]);
  // An instance may have several numbers.
  std::map<std::pair<std::string_view, int>, std::int64_t> num_records;
  for (const auto& [id, subscription] : subscriptions_)
    num_records[{subscription.topic, subscription.instance}] += subscription.num_records;
  for (const auto& [source, num] : num_records) {
    const auto& [topic, instance] = source;
    if (num == 0) continue;
    if (!kept_.contains(topic)) {
      ledger.count(fmt::format("topic {}", topic), known, num);
      continue;
    }
    for (const std::string& field : formats_.find(topic)->second.order) {
      const std::string name = fmt::format("{}.{}", topic, field);
      const core::KnownName* found = core::find_known(known, name);
      if (found != nullptr && found->is_used && !is_read(topic, instance, field))
        ledger.ignore(name, "another topic or instance is read", num);
      else
        ledger.count(name, known, num);
    }
  }
}

std::string_view UlogFile::text(std::size_t begin, std::size_t size) const {
  return {reinterpret_cast<const char*>(bytes_.data()) + begin, size};
}

std::string UlogFile::at_byte(std::size_t offset) const {
  return fmt::format("{}, byte {}", file_.string(), offset);
}

}  // namespace terracast::geo
