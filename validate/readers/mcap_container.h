#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// Files of MCAP (https://mcap.dev/spec), version 0, of uncompressed chunks.
namespace terracast::validate {

/// Where a message lies in its file.
struct BagMessage {
  std::int64_t log_ns = 0;
  std::uint64_t offset = 0;  ///< of its content in the file
  std::uint64_t num_bytes = 0;
};

struct BagTopic {
  std::string topic, type, encoding;
  std::string definition_encoding;
  std::shared_ptr<const std::string> definition;  ///< of the type; channels share it
  std::map<std::string, std::string> metadata;
  std::vector<BagMessage> messages;  ///< in the file's order
};

struct BagFile {
  std::string profile;
  std::map<std::string, BagTopic> topics;  ///< by name
  std::map<std::string, std::map<std::string, std::string>> metadata;
};

/// Reads a file from start to end, but for the messages' content, and holds its parts against each other: the CRCs of
/// chunks, data and summary, message and chunk indexes, schemas and channels of the summary, statistics, summary offsets,
/// and that log times rise.
/// name     for messages
/// cost     reads the file once, in blocks; memory is bounded by what the file holds: 40 bytes a message
/// throws   Input: no such file, what is wrong and at which byte; Io
BagFile read_bag_file(const std::filesystem::path& file, const std::string& name);

/// Bytes of a file.
/// throws   Input: they lie beyond its end; Io
std::vector<std::byte> read_bytes_at(const std::filesystem::path& file, const std::string& name,
                                     std::uint64_t offset, std::uint64_t num_bytes);

}  // namespace terracast::validate
