#include "export/mcap/mcap_file.h"

#include <algorithm>
#include <array>
#include <bit>

#include "core/crc32.h"
#include "core/error.h"

namespace terracast::exporters {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::array<std::uint8_t, 8> kMagic = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
constexpr std::size_t kChunkBytes = std::size_t{1} << 22;

/// The first byte of a record.
enum Opcode : std::uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kStatistics = 0x0b,
  kMetadata,
  kMetadataIndex,
  kSummaryOffset,
  kDataEnd
};
/// Opcode and length.
constexpr std::size_t kRecordHeadBytes = 9;

/// Ids of schemas and channels count from 1: a schema of id 0 is none.
std::uint16_t id_of(std::size_t place) { return static_cast<std::uint16_t>(place + 1); }

}  // namespace

McapBytes& McapBytes::text(std::string_view words) {
  put(static_cast<std::uint32_t>(words.size()));
  return raw(std::as_bytes(std::span(words)));
}

McapBytes& McapBytes::map(const std::map<std::string, std::string>& entries) {
  McapBytes inner;
  for (const auto& [key, value] : entries) inner.text(key).text(value);
  put(static_cast<std::uint32_t>(inner.size()));
  return raw(inner.bytes());
}

McapBytes& McapBytes::raw(std::span<const std::byte> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return *this;
}

McapFile::McapFile(std::filesystem::path file, std::string_view library,
                   const std::vector<McapChannel>& channels)
    : file_(std::move(file)), out_(file_, std::ios::binary | std::ios::trunc) {
  TERRACAST_CHECK(channels.size() < 0xffff, "{} channels in {}", channels.size(), file_.string());
  put(std::as_bytes(std::span(kMagic)));
  put_record(kHeader, McapBytes().text("ros2").text(library));
  std::vector<std::string> types;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const McapChannel& channel = channels[i];
    auto type = std::find(types.begin(), types.end(), channel.type);
    if (type == types.end()) {
      type = types.insert(type, channel.type);
      schemas_.push_back(McapBytes()
                             .put(id_of(types.size() - 1))
                             .text(channel.type)
                             .text("ros2msg")
                             .text(channel.definition));
      put_record(kSchema, schemas_.back());
    }
    channels_.push_back(McapBytes()
                            .put(id_of(i))
                            .put(id_of(static_cast<std::size_t>(type - types.begin())))
                            .text(channel.topic)
                            .text("cdr")
                            .map(channel.metadata));
    put_record(kChannel, channels_.back());
  }
  counts_.of_channels.resize(channels.size());
}

void McapFile::put(std::span<const std::byte> bytes) {
  out_.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  if (!out_)
    core::fail(core::ErrorKind::Io, "{}: cannot be written at byte {}", file_.string(), offset_);
  offset_ += bytes.size();
  crc_ = core::crc32_of(bytes, crc_);
}

void McapFile::put_record(std::uint8_t opcode, const McapBytes& content) {
  put(McapBytes().put(opcode).put(std::uint64_t{content.size()}).bytes());
  put(content.bytes());
}

void McapFile::add_metadata(const std::string& name,
                            const std::map<std::string, std::string>& entries) {
  end_chunk();
  const McapBytes record = McapBytes().text(name).map(entries);
  const McapBytes index =
      McapBytes().put(offset_).put(std::uint64_t{kRecordHeadBytes + record.size()}).text(name);
  metadata_index_.put(std::uint8_t{kMetadataIndex})
      .put(std::uint64_t{index.size()})
      .raw(index.bytes());
  ++num_metadata_;
  put_record(kMetadata, record);
}

void McapFile::write(std::size_t channel, std::int64_t log_ns, std::span<const std::byte> message) {
  TERRACAST_CHECK(log_ns >= 0 && (counts_.num_messages == 0 || log_ns >= counts_.last_ns),
                  "a message of {} ns after one of {} ns", log_ns, counts_.last_ns);
  constexpr std::size_t kMessageHeadBytes = 22;
  const std::size_t num_bytes = kRecordHeadBytes + kMessageHeadBytes + message.size();
  if (chunk_.size() + num_bytes > kChunkBytes) end_chunk();
  if (chunk_.size() == 0) chunk_first_ns_ = log_ns;
  chunk_last_ns_ = log_ns;
  const auto time = static_cast<std::uint64_t>(log_ns);
  chunk_index_[id_of(channel)].emplace_back(time, chunk_.size());
  chunk_.put(std::uint8_t{kMessage})
      .put(std::uint64_t{kMessageHeadBytes + message.size()})
      .put(id_of(channel))
      .put(static_cast<std::uint32_t>(counts_.of_channels[channel]))
      .put(time)
      .put(time)  // published when it was logged
      .raw(message);
  if (counts_.num_messages == 0) counts_.first_ns = log_ns;
  counts_.last_ns = log_ns;
  ++counts_.num_messages;
  ++counts_.of_channels[channel];
}

void McapFile::end_chunk() {
  if (chunk_.size() == 0) return;
  IndexedChunk chunk{.first_ns = static_cast<std::uint64_t>(chunk_first_ns_),
                     .last_ns = static_cast<std::uint64_t>(chunk_last_ns_),
                     .offset = offset_,
                     .length = 0,
                     .index_length = 0,
                     .num_bytes = chunk_.size(),
                     .indexes = {}};
  McapBytes head;
  head.put(chunk.first_ns)
      .put(chunk.last_ns)
      .put(chunk.num_bytes)
      .put(core::crc32_of(chunk_.bytes()))
      .text("")
      .put(chunk.num_bytes);
  put(McapBytes().put(std::uint8_t{kChunk}).put(head.size() + chunk.num_bytes).bytes());
  put(head.bytes());
  put(chunk_.bytes());
  chunk.length = offset_ - chunk.offset;
  for (const auto& [channel, places] : chunk_index_) {
    chunk.indexes.emplace_back(channel, offset_);
    constexpr std::size_t kPlaceBytes = 16;
    McapBytes index;
    index.put(channel).put(static_cast<std::uint32_t>(kPlaceBytes * places.size()));
    for (const auto& [time, place] : places) index.put(time).put(place);
    put_record(kMessageIndex, index);
  }
  chunk.index_length = offset_ - chunk.offset - chunk.length;
  chunks_.push_back(std::move(chunk));
  chunk_.clear();
  chunk_index_.clear();
}

McapBytes McapFile::statistics() const {
  McapBytes record;
  record.put(counts_.num_messages)
      .put(static_cast<std::uint16_t>(schemas_.size()))
      .put(static_cast<std::uint32_t>(channels_.size()))
      .put(std::uint32_t{0})  // attachments
      .put(num_metadata_)
      .put(static_cast<std::uint32_t>(chunks_.size()))
      .put(static_cast<std::uint64_t>(counts_.first_ns))
      .put(static_cast<std::uint64_t>(counts_.last_ns));
  McapBytes counts;
  for (std::size_t i = 0; i < counts_.of_channels.size(); ++i)
    counts.put(id_of(i)).put(counts_.of_channels[i]);
  return record.put(static_cast<std::uint32_t>(counts.size())).raw(counts.bytes());
}

McapCounts McapFile::finish() {
  end_chunk();
  put_record(kDataEnd, McapBytes().put(crc_));
  const std::uint64_t summary = offset_;
  crc_ = 0;
  McapBytes groups;
  const auto put_group = [&](Opcode opcode, auto&& put_records) {
    const std::uint64_t start = offset_;
    put_records();
    if (offset_ > start)
      groups.put(std::uint8_t{kSummaryOffset})
          .put(std::uint64_t{17})
          .put(std::uint8_t{opcode})
          .put(start)
          .put(offset_ - start);
  };
  put_group(kSchema, [&] {
    for (const McapBytes& schema : schemas_) put_record(kSchema, schema);
  });
  put_group(kChannel, [&] {
    for (const McapBytes& channel : channels_) put_record(kChannel, channel);
  });
  put_group(kStatistics, [&] { put_record(kStatistics, statistics()); });
  put_group(kMetadataIndex, [&] { put(metadata_index_.bytes()); });
  put_group(kChunkIndex, [&] {
    for (const IndexedChunk& chunk : chunks_) {
      McapBytes offsets;
      for (const auto& [channel, offset] : chunk.indexes) offsets.put(channel).put(offset);
      put_record(kChunkIndex, McapBytes()
                                  .put(chunk.first_ns)
                                  .put(chunk.last_ns)
                                  .put(chunk.offset)
                                  .put(chunk.length)
                                  .put(static_cast<std::uint32_t>(offsets.size()))
                                  .raw(offsets.bytes())
                                  .put(chunk.index_length)
                                  .text("")
                                  .put(chunk.num_bytes)
                                  .put(chunk.num_bytes));
    }
  });
  const std::uint64_t offsets = offset_;
  put(groups.bytes());
  put(McapBytes()
          .put(std::uint8_t{kFooter})
          .put(std::uint64_t{20})
          .put(summary)
          .put(offsets)
          .bytes());
  put(McapBytes().put(crc_).raw(std::as_bytes(std::span(kMagic))).bytes());
  out_.close();
  if (!out_) core::fail(core::ErrorKind::Io, "{}: cannot be written", file_.string());
  return counts_;
}

}  // namespace terracast::exporters
