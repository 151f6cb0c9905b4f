#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Files of MCAP, version 0, by https://mcap.dev/spec: chunks without compression, message indexes, a summary with chunk
/// indexes and statistics, and every CRC.
namespace terracast::exporters {

/// Numbers as MCAP has them, little-endian, one after the other.
class McapBytes {
 public:
  template <class Number>
  McapBytes& put(Number number) {
    const auto* at = reinterpret_cast<const std::byte*>(&number);
    bytes_.insert(bytes_.end(), at, at + sizeof(Number));
    return *this;
  }
  /// With its length before it.
  McapBytes& text(std::string_view words);
  McapBytes& map(const std::map<std::string, std::string>& entries);
  McapBytes& raw(std::span<const std::byte> bytes);
  std::size_t size() const { return bytes_.size(); }
  std::span<const std::byte> bytes() const { return bytes_; }
  void clear() { bytes_.clear(); }

 private:
  std::vector<std::byte> bytes_;
};

/// A stream of messages of one type.
struct McapChannel {
  std::string topic;
  std::string type;        ///< of its messages: the name of its schema
  std::string definition;  ///< of the type, as the profile writes types
  std::map<std::string, std::string> metadata = {};
};

/// What a finished file holds.
struct McapCounts {
  std::vector<std::uint64_t> of_channels;  ///< messages, by a channel's place
  std::uint64_t num_messages = 0;
  std::int64_t first_ns = 0, last_ns = 0;  ///< log times; 0 where there is no message
};

/// Writes one file from its start to its end.
///
/// memory    a chunk (4 MiB, or one message that is larger), and 100 bytes for each chunk and channel in it
class McapFile {
 public:
  /// Messages of all channels are CDR; their schemas are ros2msg.
  /// throws   Io: the file cannot be written; as all below
  McapFile(std::filesystem::path file, std::string_view library,
           const std::vector<McapChannel>& channels);

  void add_metadata(const std::string& name, const std::map<std::string, std::string>& entries);
  /// channel   its place among the channels
  /// log_ns    since 1970; not before that of the message before
  void write(std::size_t channel, std::int64_t log_ns, std::span<const std::byte> message);
  /// Of what was written.
  const McapCounts& counts() const { return counts_; }
  /// Writes the summary and closes the file.
  McapCounts finish();

 private:
  struct IndexedChunk {
    std::uint64_t first_ns, last_ns, offset, length, index_length, num_bytes;
    std::vector<std::pair<std::uint16_t, std::uint64_t>> indexes;  ///< channel and offset
  };

  void put(std::span<const std::byte> bytes);
  void put_record(std::uint8_t opcode, const McapBytes& content);
  void end_chunk();
  McapBytes statistics() const;

  std::filesystem::path file_;
  std::ofstream out_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;  ///< of what was written since the file's or the summary's start
  std::vector<McapBytes> schemas_, channels_;
  McapBytes metadata_index_;
  std::uint32_t num_metadata_ = 0;
  McapBytes chunk_;
  std::int64_t chunk_first_ns_ = 0, chunk_last_ns_ = 0;
  /// Log times and offsets in the chunk, by channel.
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>> chunk_index_;
  std::vector<IndexedChunk> chunks_;
  McapCounts counts_;
};

}  // namespace terracast::exporters
