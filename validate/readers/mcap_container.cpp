#include "validate/readers/mcap_container.h"

#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <tuple>

#include "core/crc32.h"
#include "core/error.h"
#include "core/printable.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::array<unsigned char, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::uint64_t kHeadBytes = 9;  // a record's opcode and length

/// The file from its start on, never beyond its end. CRCs of what is taken are kept.
class Cursor {
 public:
  Cursor(const std::filesystem::path& file, std::string name)
      : in_(file, std::ios::binary), name_(std::move(name)) {
    std::error_code error;
    num_bytes_ = std::filesystem::file_size(file, error);
    if (error || !in_) fail(ErrorKind::Input, "{}: missing, or no file that can be read", name_);
  }

  std::uint64_t at() const { return at_; }
  std::uint64_t num_bytes() const { return num_bytes_; }
  const std::string& name() const { return name_; }

  void take(std::span<std::byte> bytes) {
    need(bytes.size());
    in_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!in_) fail(ErrorKind::Io, "{}: cannot be read at byte {}", name_, at_);
    at_ += bytes.size();
    crc_ = core::crc32_of(bytes, crc_);
    inner_crc_ = core::crc32_of(bytes, inner_crc_);
  }
  template <class Number>
  Number take() {
    std::array<std::byte, sizeof(Number)> bytes;
    take(bytes);
    Number number;
    std::memcpy(&number, bytes.data(), sizeof(Number));
    return number;
  }
  /// Bytes behind their length.
  std::string text() {
    std::string words(need(take<std::uint32_t>()), '\0');
    take(std::as_writable_bytes(std::span(words)));
    return words;
  }
  void skip(std::uint64_t count) {
    need(count);
    std::array<std::byte, 65536> block;
    for (std::uint64_t left = count; left > 0;) {
      const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(left, block.size()));
      take(std::span(block).first(size));
      left -= size;
    }
  }
  /// throws   Input: what is announced goes beyond the file's end, or that of the record
  std::uint64_t need(std::uint64_t count) const {
    if (count > end() - at_)
      fail(ErrorKind::Input, "{}: {} bytes announced at byte {}, but {} are left", name_, count,
           at_, end() - at_);
    return count;
  }

  /// From here on nothing beyond `end` may be taken.
  void limit_to(std::uint64_t end) { ends_.push_back(end); }
  void end_limit() { ends_.pop_back(); }
  std::uint64_t end() const { return ends_.empty() ? num_bytes_ : ends_.back(); }

  void begin_crc() { crc_ = 0; }
  std::uint32_t crc() const { return crc_; }
  void begin_inner_crc() { inner_crc_ = 0; }
  std::uint32_t inner_crc() const { return inner_crc_; }

 private:
  std::ifstream in_;
  std::string name_;
  std::uint64_t at_ = 0, num_bytes_ = 0;
  std::vector<std::uint64_t> ends_;
  std::uint32_t crc_ = 0, inner_crc_ = 0;
};

struct Schema {
  std::string name, encoding, text;
  bool operator==(const Schema&) const = default;
};
struct Channel {
  std::uint16_t schema = 0;
  std::string topic, encoding;
  std::map<std::string, std::string> metadata;
  bool operator==(const Channel&) const = default;
};
using Places = std::vector<std::pair<std::uint64_t, std::uint64_t>>;  // log time, place in a chunk

/// A chunk as it was read, or as an index has it.
struct Chunk {
  std::uint64_t first_ns = 0, last_ns = 0, offset = 0, length = 0, index_length = 0, num_bytes = 0;
  std::map<std::uint16_t, std::uint64_t> indexes;
  bool operator==(const Chunk&) const = default;
};

class BagParser {
 public:
  BagParser(const std::filesystem::path& file, const std::string& name) : in_(file, name) {}

  BagFile parse() {
    check_magic("begins");
    const std::uint64_t magic_bytes = in_.at();
    bool has_header = false;
    for (bool is_data = true; is_data;) {
      const std::uint32_t crc = in_.crc();
      const std::uint64_t start = in_.at();
      const auto opcode = begin_record();
      if (has_header != (start != magic_bytes) || (start == magic_bytes) != (opcode == 0x01))
        wrong(start, "the header does not stand first, and once");
      has_header = true;
      is_data = opcode != 0x0f;
      if (!is_data) {
        const auto stated = in_.take<std::uint32_t>();
        if (stated != 0 && stated != crc)
          wrong(start,
                fmt::format("the CRC of the data is {:08x}, but {:08x} is stated", crc, stated));
      } else {
        read_data_record(opcode, start);
      }
      end_record();
    }
    read_summary();
    return result();
  }

 private:
  [[noreturn]] void wrong(std::uint64_t at, const std::string& what) const {
    fail(ErrorKind::Input, "{}: at byte {}: {}", in_.name(), at, what);
  }

  void check_magic(const char* word) {
    std::array<std::byte, 8> bytes;
    in_.take(bytes);
    if (std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
      fail(ErrorKind::Input, "{}: it {} otherwise than a file of MCAP 0 does", in_.name(), word);
  }

  std::uint8_t begin_record() {
    const auto opcode = in_.take<std::uint8_t>();
    const std::uint64_t length = in_.need(in_.take<std::uint64_t>());
    in_.limit_to(in_.at() + length);
    return opcode;
  }
  /// Records may have more at their ends than is known.
  void end_record() {
    in_.skip(in_.end() - in_.at());
    in_.end_limit();
  }

  std::map<std::string, std::string> take_map() {
    const std::uint64_t end = in_.need(in_.take<std::uint32_t>()) + in_.at();
    in_.limit_to(end);
    std::map<std::string, std::string> entries;
    while (in_.at() < end) {
      std::string key = in_.text();
      entries[std::move(key)] = in_.text();
    }
    in_.end_limit();
    return entries;
  }

  std::pair<std::uint16_t, Schema> take_schema() {
    const auto id = in_.take<std::uint16_t>();
    Schema schema{in_.text(), in_.text(), in_.text()};
    return {id, std::move(schema)};
  }
  std::pair<std::uint16_t, Channel> take_channel() {
    const auto id = in_.take<std::uint16_t>();
    Channel channel;
    channel.schema = in_.take<std::uint16_t>();
    channel.topic = in_.text();
    channel.encoding = in_.text();
    channel.metadata = take_map();
    return {id, std::move(channel)};
  }

  void read_data_record(std::uint8_t opcode, std::uint64_t start) {
    if (!open_indexes_.empty() && opcode != 0x07)
      wrong(start,
            "a chunk's message indexes do not follow it: one of each of its channels is right");
    switch (opcode) {
      case 0x01:
        file_.profile = in_.text();
        in_.text();
        break;
      case 0x03:
      case 0x04:
        read_definition(opcode, start);
        break;
      case 0x06:
        read_chunk(start);
        break;
      case 0x07:
        read_message_index(start);
        break;
      case 0x0c: {
        std::string name = in_.text();
        metadata_places_.emplace_back(start, in_.end() - start, name);
        file_.metadata[std::move(name)] = take_map();
        break;
      }
      default:
        wrong(start, fmt::format("a record of opcode {:#04x} among the data", opcode));
    }
  }

  void read_definition(std::uint8_t opcode, std::uint64_t start) {
    if (opcode == 0x03) {
      const auto [id, schema] = take_schema();
      if (const auto [old, is_new] = schemas_.emplace(id, schema);
          id == 0 || (!is_new && old->second != schema))
        wrong(start, fmt::format("schema {} is 0, or stands twice", id));
    } else {
      const auto [id, channel] = take_channel();
      if (!schemas_.contains(channel.schema))
        wrong(start, fmt::format("channel {} is of schema {}, which does not stand before it", id,
                                 channel.schema));
      if (const auto [old, is_new] = channels_.emplace(id, channel);
          !is_new && old->second != channel)
        wrong(start, fmt::format("channel {} stands twice", id));
    }
  }

  void read_chunk(std::uint64_t start) {
    Chunk chunk;
    chunk.first_ns = in_.take<std::uint64_t>();
    chunk.last_ns = in_.take<std::uint64_t>();
    chunk.offset = start;
    chunk.length = in_.end() - start;
    chunk.num_bytes = in_.take<std::uint64_t>();
    const auto crc = in_.take<std::uint32_t>();
    if (const std::string compression = in_.text(); !compression.empty())
      wrong(start, fmt::format("a chunk compressed by \"{}\"; without compression is right",
                               core::first_letters(compression, 40)));
    if (in_.take<std::uint64_t>() != chunk.num_bytes || in_.end() - in_.at() != chunk.num_bytes)
      wrong(start, "a chunk's sizes contradict each other");
    in_.begin_inner_crc();
    const std::uint64_t records = in_.at();
    std::uint64_t first_ns = 0, last_ns = 0;
    while (in_.at() < records + chunk.num_bytes) {
      const std::uint64_t place = in_.at();
      const auto opcode = begin_record();
      if (opcode == 0x03 || opcode == 0x04) {
        read_definition(opcode, place);
      } else if (opcode == 0x05) {
        const std::uint64_t time = read_message(place, place - records);
        if (first_ns == 0) first_ns = time;
        last_ns = time;
      } else {
        wrong(place, fmt::format("a record of opcode {:#04x} in a chunk", opcode));
      }
      end_record();
    }
    if (crc != 0 && crc != in_.inner_crc())
      wrong(start, fmt::format("the CRC of the chunk is {:08x}, but {:08x} is stated",
                               in_.inner_crc(), crc));
    if (first_ns != chunk.first_ns || last_ns != chunk.last_ns)
      wrong(start, "a chunk's times are not those of its messages");
    chunks_.push_back(std::move(chunk));
  }

  /// returns   its log time
  std::uint64_t read_message(std::uint64_t start, std::uint64_t place) {
    const auto channel = in_.take<std::uint16_t>();
    const auto sequence = in_.take<std::uint32_t>();
    const auto log_ns = in_.take<std::uint64_t>();
    const auto publish_ns = in_.take<std::uint64_t>();
    if (!channels_.contains(channel))
      wrong(start, fmt::format("a message of channel {}, which does not stand before it", channel));
    if (log_ns > std::uint64_t{1} << 62 || log_ns < last_ns_)
      wrong(start, fmt::format("a log time of {} ns after one of {} ns", log_ns, last_ns_));
    if (publish_ns != log_ns)
      wrong(start, "a message that was published at another time than it was logged");
    std::vector<BagMessage>& messages = messages_[channel];
    if (sequence != static_cast<std::uint32_t>(messages.size()))
      wrong(start,
            fmt::format("message {} of a channel has the number {}", messages.size(), sequence));
    if (num_messages_++ == 0) first_ns_ = log_ns;
    last_ns_ = log_ns;
    messages.push_back({.log_ns = static_cast<std::int64_t>(log_ns),
                        .offset = in_.at(),
                        .num_bytes = in_.end() - in_.at()});
    open_indexes_[channel].emplace_back(log_ns, place);
    return log_ns;
  }

  void read_message_index(std::uint64_t start) {
    const auto channel = in_.take<std::uint16_t>();
    const std::uint64_t end = in_.need(in_.take<std::uint32_t>()) + in_.at();
    Places places;
    while (in_.at() < end) {
      const auto time = in_.take<std::uint64_t>();
      places.emplace_back(time, in_.take<std::uint64_t>());
    }
    const auto right = open_indexes_.find(channel);
    if (right == open_indexes_.end() || right->second != places)
      wrong(start, fmt::format("the message index of channel {} is not that of the chunk before it",
                               channel));
    open_indexes_.erase(right);
    chunks_.back().indexes[channel] = start;
    chunks_.back().index_length = in_.end() - chunks_.back().offset - chunks_.back().length;
  }

  void read_summary() {
    const std::uint64_t summary = in_.at();
    in_.begin_crc();
    std::vector<std::tuple<std::uint8_t, std::uint64_t, std::uint64_t>> groups, stated;
    std::uint64_t offsets = 0;
    for (bool is_footer = false; !is_footer;) {
      const std::uint64_t start = in_.at();
      const auto opcode = begin_record();
      is_footer = opcode == 0x02;
      if (opcode == 0x0e) {
        if (offsets == 0) offsets = start;
        const auto group = in_.take<std::uint8_t>();
        const auto from = in_.take<std::uint64_t>();
        stated.emplace_back(group, from, in_.take<std::uint64_t>());
      } else if (is_footer) {
        read_footer(start, summary, offsets);
      } else {
        if (groups.empty() || std::get<0>(groups.back()) != opcode)
          groups.emplace_back(opcode, start, 0);
        std::get<2>(groups.back()) += in_.end() - start;
        read_summary_record(opcode, start);
      }
      end_record();
    }
    if (groups != stated)
      wrong(offsets, "the summary offsets are not those of the summary's groups");
    check_magic("ends");
    if (in_.at() != in_.num_bytes()) wrong(in_.at(), "there is more behind the end");
    if (summary_schemas_ != schemas_ || summary_channels_ != channels_)
      wrong(summary, "the summary has other schemas or channels than the data");
    if (summary_chunks_ != chunks_)
      wrong(summary, fmt::format("the summary's {} chunk indexes are not those of the {} chunks, "
                                 "without which readers find no messages",
                                 summary_chunks_.size(), chunks_.size()));
    if (summary_metadata_ != metadata_places_)
      wrong(summary, "the summary's metadata indexes are not those of the metadata");
    if (!has_statistics_)
      wrong(summary, "there are no statistics, which rosbag2 cannot do without");
  }

  void read_footer(std::uint64_t start, std::uint64_t summary, std::uint64_t offsets) {
    if (in_.take<std::uint64_t>() != summary)
      wrong(start, "the footer has another place of the summary");
    if (in_.take<std::uint64_t>() != offsets)
      wrong(start, "the footer has another place of the summary offsets");
    const std::uint32_t crc = in_.crc();
    const auto stated = in_.take<std::uint32_t>();
    if (stated != 0 && stated != crc)
      wrong(start,
            fmt::format("the CRC of the summary is {:08x}, but {:08x} is stated", crc, stated));
  }

  void read_summary_record(std::uint8_t opcode, std::uint64_t start) {
    switch (opcode) {
      case 0x03:
        summary_schemas_.insert(take_schema());
        break;
      case 0x04:
        summary_channels_.insert(take_channel());
        break;
      case 0x08:
        read_chunk_index();
        break;
      case 0x0b:
        read_statistics(start);
        break;
      case 0x0d: {
        const auto offset = in_.take<std::uint64_t>();
        const auto length = in_.take<std::uint64_t>();
        summary_metadata_.emplace_back(offset, length, in_.text());
        break;
      }
      default:
        wrong(start, fmt::format("a record of opcode {:#04x} in the summary", opcode));
    }
  }

  std::map<std::uint16_t, std::uint64_t> take_numbers() {
    const std::uint64_t end = in_.need(in_.take<std::uint32_t>()) + in_.at();
    std::map<std::uint16_t, std::uint64_t> numbers;
    while (in_.at() < end) {
      const auto key = in_.take<std::uint16_t>();
      numbers[key] = in_.take<std::uint64_t>();
    }
    return numbers;
  }

  void read_chunk_index() {
    Chunk chunk;
    chunk.first_ns = in_.take<std::uint64_t>();
    chunk.last_ns = in_.take<std::uint64_t>();
    chunk.offset = in_.take<std::uint64_t>();
    chunk.length = in_.take<std::uint64_t>();
    chunk.indexes = take_numbers();
    chunk.index_length = in_.take<std::uint64_t>();
    in_.text();
    chunk.num_bytes = in_.take<std::uint64_t>();
    if (in_.take<std::uint64_t>() != chunk.num_bytes) chunk.num_bytes = 0;  // of no chunk
    summary_chunks_.push_back(std::move(chunk));
  }

  void read_statistics(std::uint64_t start) {
    std::map<std::uint16_t, std::uint64_t> counts;
    for (const auto& [id, channel] : channels_) counts[id] = messages_[id].size();
    const auto is = [&](std::uint64_t found, std::uint64_t right, const char* what) {
      if (found != right)
        wrong(start, fmt::format("the statistics count {} {}; there are {}", found, what, right));
    };
    is(in_.take<std::uint64_t>(), num_messages_, "messages");
    is(in_.take<std::uint16_t>(), schemas_.size(), "schemas");
    is(in_.take<std::uint32_t>(), channels_.size(), "channels");
    is(in_.take<std::uint32_t>(), 0, "attachments");
    is(in_.take<std::uint32_t>(), metadata_places_.size(), "metadata");
    is(in_.take<std::uint32_t>(), chunks_.size(), "chunks");
    if (in_.take<std::uint64_t>() != first_ns_ || in_.take<std::uint64_t>() != last_ns_)
      wrong(start, "the statistics' times are not those of the messages");
    if (take_numbers() != counts)
      wrong(start, "the statistics count other messages of channels than there are");
    has_statistics_ = true;
  }

  BagFile result() {
    std::map<std::uint16_t, std::shared_ptr<const std::string>> definitions;
    for (auto& [id, schema] : schemas_)
      definitions[id] = std::make_shared<const std::string>(std::move(schema.text));
    for (auto& [id, channel] : channels_) {
      const Schema& schema = schemas_.at(channel.schema);
      const bool is_new =
          file_.topics
              .emplace(channel.topic, BagTopic{.topic = channel.topic,
                                               .type = schema.name,
                                               .encoding = channel.encoding,
                                               .definition_encoding = schema.encoding,
                                               .definition = definitions.at(channel.schema),
                                               .metadata = std::move(channel.metadata),
                                               .messages = std::move(messages_[id])})
              .second;
      if (!is_new)
        fail(ErrorKind::Input, "{}: two channels have the topic {}", in_.name(),
             core::first_letters(channel.topic, 100));
    }
    return std::move(file_);
  }

  Cursor in_;
  BagFile file_;
  std::map<std::uint16_t, Schema> schemas_, summary_schemas_;
  std::map<std::uint16_t, Channel> channels_, summary_channels_;
  std::map<std::uint16_t, std::vector<BagMessage>> messages_;
  std::map<std::uint16_t, Places>
      open_indexes_;  ///< of the last chunk, those that have not followed
  std::vector<Chunk> chunks_, summary_chunks_;
  std::vector<std::tuple<std::uint64_t, std::uint64_t, std::string>> metadata_places_,
      summary_metadata_;
  std::uint64_t num_messages_ = 0, first_ns_ = 0, last_ns_ = 0;
  bool has_statistics_ = false;
};

}  // namespace

BagFile read_bag_file(const std::filesystem::path& file, const std::string& name) {
  return BagParser(file, name).parse();
}

std::vector<std::byte> read_bytes_at(const std::filesystem::path& file, const std::string& name,
                                     std::uint64_t offset, std::uint64_t num_bytes) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  if (error || offset > size || num_bytes > size - offset)
    fail(ErrorKind::Input, "{}: it has no bytes {} to {}", name, offset, offset + num_bytes);
  std::ifstream in(file, std::ios::binary);
  std::vector<std::byte> bytes(num_bytes);
  in.seekg(static_cast<std::streamoff>(offset));
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(num_bytes));
  if (!in) fail(ErrorKind::Io, "{}: cannot be read", name);
  return bytes;
}

}  // namespace terracast::validate
