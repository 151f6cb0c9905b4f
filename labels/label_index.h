#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/frame_reader.h"
#include "core/json.h"

/// `<kind>.json` in a kind's folder: of which capture its files are, and what they hold.
namespace terracast::labels {

/// Channels of a kind's files, or what stands for them, with what they are.
using ChannelMeanings = std::vector<std::pair<std::string_view, std::string_view>>;

/// The members that all have: format ("terracast <kind>"), version, capture (capture::labels_source) and channels.
core::Json begin_index(std::string_view kind, int version, const capture::SequenceReader& sequence,
                       const ChannelMeanings& channels);

/// The table of classes: id, name, parent, isthing, color.
core::Json classes_json();

/// Removes an index before its files change: until all are there again, nothing says that they are.
/// throws    Io
void remove_index(const std::filesystem::path& file);

/// Whether a file holds these bytes.
/// throws    Io
bool holds(const std::filesystem::path& file, std::span<const std::byte> bytes);

/// Writes what is not there already, to the byte.
/// returns   whether it was written
/// throws    Io
bool write_unless_same(const std::filesystem::path& file, std::span<const std::byte> bytes);

/// The same of an index.
/// indent   as Json::text()
void write_index(const std::filesystem::path& file, const core::Json& index, int indent = 2);

}  // namespace terracast::labels
