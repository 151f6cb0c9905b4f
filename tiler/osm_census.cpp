#include "tiler/osm_census.h"

#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "tiler/file_memo.h"
#include "tiler/osm_text.h"

namespace terracast::tiler {
namespace {

/// Of a block of a .pbf file, by the format's definition.
constexpr std::size_t kLargestHeader = 64 * 1024;
constexpr std::size_t kLargestBlock = 32 * 1024 * 1024;
constexpr std::size_t kChunk = 1 << 20;
/// No element of an .osm file is longer.
constexpr std::size_t kLongestElement = 1 << 20;

struct VsiCloser {
  void operator()(VSILFILE* file) const { VSIFCloseL(file); }
};
using VsiFile = std::unique_ptr<VSILFILE, VsiCloser>;

/// Numbers that are there.
class Numbers {
 public:
  /// False: it comes after one that is higher.
  bool add(std::int64_t number) {
    const bool is_next = numbers_.empty() || numbers_.back() <= number;
    is_sorted_ = is_sorted_ && is_next;
    numbers_.push_back(number);
    return is_next;
  }
  void sort() {
    if (!is_sorted_) std::sort(numbers_.begin(), numbers_.end());
    is_sorted_ = true;
  }
  /// How many stand there once more; once they are sorted.
  std::int64_t num_repeated() const {
    std::int64_t num = 0;
    for (std::size_t i = 1; i < numbers_.size(); ++i) num += numbers_[i] == numbers_[i - 1] ? 1 : 0;
    return num;
  }
  /// How many of some numbers there are by now; nullopt: that would take more time than reading, where nodes and ways
  /// come in turns and in no order.
  std::optional<std::int64_t> num_of(const std::vector<std::int64_t>& numbers) {
    constexpr int kMostSorted = 16;
    if (!is_sorted_ && ++num_sorted_ > kMostSorted) return std::nullopt;
    sort();
    return std::count_if(numbers.begin(), numbers.end(), [&](std::int64_t number) {
      return std::binary_search(numbers_.begin(), numbers_.end(), number);
    });
  }

 private:
  std::vector<std::int64_t> numbers_;
  bool is_sorted_ = true;
  int num_sorted_ = 0;
};

/// Counts elements in any order. Of which members come later, it is judged at the file's end.
class Counter {
 public:
  void add_node(std::int64_t id) {
    ++census.num_nodes;
    note(id);
    if (!nodes_.add(id)) census.has_nodes_in_order = false;
  }
  void add_way(std::int64_t id, std::vector<std::int64_t> nodes) {
    ++census.num_ways;
    note(id);
    ways_.add(id);
    take({.is_area = false, .num_before = 0, .members = std::move(nodes)});
  }
  void add_area(std::int64_t id, std::vector<std::int64_t> ways) {
    ++census.num_areas;
    note(id);
    take({.is_area = true, .num_before = 0, .members = std::move(ways)});
  }
  OsmCensus finish() {
    nodes_.sort();
    ways_.sort();
    census.num_repeated = nodes_.num_repeated() + ways_.num_repeated();
    for (const Waiting& waiting : waiting_) {
      const std::int64_t num = numbers_for(waiting).num_of(waiting.members).value();
      judge(waiting, num);
      const bool is_known = waiting.num_before >= 0;
      if (num > waiting.num_before && (is_known || census.is_text)) ++census.num_before_members;
    }
    std::sort(census.deleted.begin(), census.deleted.end());
    return std::move(census);
  }

  OsmCensus census;

 private:
  /// A way or an area of which not all members have come yet.
  struct Waiting {
    bool is_area;
    std::int64_t num_before;  ///< members that came before it; -1: not known
    std::vector<std::int64_t> members;
  };

  void note(std::int64_t id) { census.num_negative += id < 0 ? 1 : 0; }
  Numbers& numbers_for(const Waiting& one) { return one.is_area ? ways_ : nodes_; }
  void take(Waiting one) {
    const std::optional<std::int64_t> num = numbers_for(one).num_of(one.members);
    const auto num_members = static_cast<std::int64_t>(one.members.size());
    if (num == num_members) return judge(one, num_members);
    // Of hostile files alone so many are kept that this is too much.
    num_waiting_ += one.members.size();
    if (num_waiting_ > kMostWaiting) {
      census.is_whole = false;
      return;
    }
    one.num_before = num.value_or(-1);
    waiting_.push_back(std::move(one));
  }
  void judge(const Waiting& one, std::int64_t num_there) {
    const bool is_cut = num_there < static_cast<std::int64_t>(one.members.size());
    if (one.is_area)
      census.num_areas_cut += is_cut ? 1 : 0;
    else if (num_there < 2)
      ++census.num_ways_without_nodes;
    else
      census.num_ways_cut += is_cut ? 1 : 0;
  }

  static constexpr std::size_t kMostWaiting = std::size_t{1} << 26;
  Numbers nodes_;
  Numbers ways_;
  std::vector<Waiting> waiting_;
  std::size_t num_waiting_ = 0;
};

// The text form: elements one after the other, of which attributes are looked at.

class TextCounter {
 public:
  /// What stands between < and >.
  void take(std::string_view element) {
    if (element.starts_with("!--") || element.starts_with("?")) return;
    if (element.starts_with("/")) {
      close(element.substr(1));
      return;
    }
    const std::string_view name = osm_element_name(element);
    if (name == "node" || name == "way" || name == "relation") {
      open(name, element);
      if (element.ends_with('/')) close(name);
    } else if (name == "nd") {
      if (const auto node = osm_number_in(element, "ref")) members_.push_back(*node);
    } else if (name == "member" && osm_attribute(element, "type") == "way") {
      if (const auto way = osm_number_in(element, "ref")) members_.push_back(*way);
    } else if (name == "tag" && osm_attribute(element, "k") == "type") {
      const std::string_view type = osm_attribute(element, "v");
      is_area_ = type == "multipolygon" || type == "boundary";
    }
  }
  Counter counter;

 private:
  void open(std::string_view name, std::string_view element) {
    id_ = osm_number_in(element, "id");
    is_deleted_ = osm_attribute(element, "action") == "delete" ||
                  osm_attribute(element, "visible") == "false";
    members_.clear();
    is_area_ = false;
    if (id_ && is_deleted_) counter.census.deleted.emplace_back(name.front(), *id_);
  }
  void close(std::string_view name) {
    if (!id_ || is_deleted_) return;
    if (name == "node")
      counter.add_node(*id_);
    else if (name == "way")
      counter.add_way(*id_, std::move(members_));
    else if (name == "relation" && is_area_)
      counter.add_area(*id_, std::move(members_));
    else if (name != "relation")
      return;
    id_.reset();
  }

  std::optional<std::int64_t> id_;
  bool is_deleted_ = false;
  bool is_area_ = false;
  std::vector<std::int64_t> members_;
};

OsmCensus count_text(VSILFILE* file) {
  TextCounter counter;
  std::string rest;
  std::string chunk(kChunk, '\0');
  while (const std::size_t size = VSIFReadL(chunk.data(), 1, chunk.size(), file)) {
    rest.append(chunk, 0, size);
    std::string_view text = rest;
    while (true) {
      const std::size_t start = text.find('<');
      if (start == std::string_view::npos) {
        text = {};
        break;
      }
      text.remove_prefix(start);
      const std::size_t end = end_of_osm_element(text.substr(1));
      if (end == std::string_view::npos) break;
      counter.take(text.substr(1, end));
      text.remove_prefix(end + 2);
    }
    rest = std::string(text);
    if (rest.size() > kLongestElement) {
      counter.counter.census.is_whole = false;
      break;
    }
  }
  counter.counter.census.is_text = true;
  return counter.counter.finish();
}

// The binary form: messages of Protocol Buffers.

/// A message's fields, one by one.
class Message {
 public:
  explicit Message(std::string_view bytes) : bytes_(bytes) {}

  /// False: at its end, or it is damaged.
  bool next() {
    std::uint64_t key = 0;
    if (!take_varint(key)) return false;
    field_ = static_cast<int>(key >> 3 & 0x1fffffff);
    content_ = {};
    value_ = 0;
    switch (key & 7) {
      case 0:
        return take_varint(value_);
      case 1:
        return skip(8);
      case 2: {
        std::uint64_t size = 0;
        if (!take_varint(size) || size > bytes_.size()) return is_sound_ = false;
        content_ = bytes_.substr(0, static_cast<std::size_t>(size));
        bytes_.remove_prefix(static_cast<std::size_t>(size));
        return true;
      }
      case 5:
        return skip(4);
      default:
        return is_sound_ = false;
    }
  }
  int field() const { return field_; }
  std::uint64_t value() const { return value_; }
  std::string_view content() const { return content_; }
  bool is_sound() const { return is_sound_; }

  bool take_varint(std::uint64_t& value) {
    value = 0;
    if (bytes_.empty()) return false;
    for (int shift = 0; shift < 64 && !bytes_.empty(); shift += 7) {
      const auto byte = static_cast<std::uint8_t>(bytes_.front());
      bytes_.remove_prefix(1);
      value |= static_cast<std::uint64_t>(byte & 127) << shift;
      if (byte < 128) return true;
    }
    return is_sound_ = false;
  }

 private:
  bool skip(std::size_t size) {
    if (bytes_.size() < size) return is_sound_ = false;
    bytes_.remove_prefix(size);
    return true;
  }
  std::string_view bytes_;
  std::string_view content_;
  std::uint64_t value_ = 0;
  int field_ = 0;
  bool is_sound_ = true;
};

std::int64_t signed_of(std::uint64_t zigzag) {
  return static_cast<std::int64_t>(zigzag >> 1) ^ -static_cast<std::int64_t>(zigzag & 1);
}

std::vector<std::uint64_t> packed(std::string_view bytes) {
  std::vector<std::uint64_t> values;
  Message message(bytes);
  for (std::uint64_t value = 0; message.take_varint(value);) values.push_back(value);
  return values;
}

/// Each from the one before.
std::vector<std::int64_t> packed_steps(std::string_view bytes) {
  std::vector<std::int64_t> values;
  std::uint64_t sum = 0;  // wraps, as hostile steps may
  for (const std::uint64_t step : packed(bytes)) {
    sum += static_cast<std::uint64_t>(signed_of(step));
    values.push_back(static_cast<std::int64_t>(sum));
  }
  return values;
}

class BinaryCounter {
 public:
  /// The header of the file.
  void take_header(std::string_view bytes) {
    Message message(bytes);
    while (message.next())
      if ((message.field() == 4 || message.field() == 5) && message.content() == "LocationsOnWays")
        counter.census.has_places_in_ways = true;
  }
  bool take_block(std::string_view bytes) {
    std::vector<std::string_view> strings;
    Message message(bytes);
    std::vector<std::string_view> groups;
    while (message.next()) {
      if (message.field() == 1) {
        Message table(message.content());
        while (table.next()) strings.push_back(table.content());
      } else if (message.field() == 2) {
        groups.push_back(message.content());
      }
    }
    for (const std::string_view group : groups) take_group(group, strings);
    return message.is_sound();
  }
  Counter counter;

 private:
  void take_group(std::string_view bytes, const std::vector<std::string_view>& strings) {
    Message message(bytes);
    while (message.next()) {
      Message inner(message.content());
      switch (message.field()) {
        case 1:
          while (inner.next())
            if (inner.field() == 1) counter.add_node(signed_of(inner.value()));
          break;
        case 2:
          while (inner.next())
            if (inner.field() == 1)
              for (const std::int64_t id : packed_steps(inner.content())) counter.add_node(id);
          break;
        case 3:
          take_way(inner);
          break;
        case 4:
          take_relation(inner, strings);
          break;
        default:
          break;
      }
    }
  }
  void take_way(Message& message) {
    std::int64_t id = 0;
    std::vector<std::int64_t> nodes;
    while (message.next()) {
      if (message.field() == 1) id = static_cast<std::int64_t>(message.value());
      if (message.field() == 8) nodes = packed_steps(message.content());
      if (message.field() == 9) counter.census.has_places_in_ways = true;
    }
    counter.add_way(id, std::move(nodes));
  }
  void take_relation(Message& message, const std::vector<std::string_view>& strings) {
    std::int64_t id = 0;
    std::vector<std::uint64_t> keys;
    std::vector<std::uint64_t> values;
    std::vector<std::int64_t> members;
    std::vector<std::uint64_t> kinds;
    while (message.next()) {
      if (message.field() == 1) id = static_cast<std::int64_t>(message.value());
      if (message.field() == 2) keys = packed(message.content());
      if (message.field() == 3) values = packed(message.content());
      if (message.field() == 9) members = packed_steps(message.content());
      if (message.field() == 10) kinds = packed(message.content());
    }
    const auto text = [&](std::uint64_t index) {
      return index < strings.size() ? strings[static_cast<std::size_t>(index)] : std::string_view();
    };
    bool is_area = false;
    for (std::size_t i = 0; i < std::min(keys.size(), values.size()); ++i)
      if (text(keys[i]) == "type")
        is_area = text(values[i]) == "multipolygon" || text(values[i]) == "boundary";
    if (!is_area) return;
    std::vector<std::int64_t> ways;
    for (std::size_t i = 0; i < std::min(members.size(), kinds.size()); ++i)
      if (kinds[i] == 1) ways.push_back(members[i]);
    counter.add_area(id, std::move(ways));
  }
};

bool read_bytes(VSILFILE* file, std::size_t size, std::string& bytes) {
  bytes.resize(size);
  return VSIFReadL(bytes.data(), 1, size, file) == size;
}

/// The content of a blob; nullopt: it is damaged, or packed in a way that GDAL does not read either.
std::optional<std::string> unpacked(std::string_view blob) {
  Message message(blob);
  std::string_view raw;
  std::string_view zlib;
  std::uint64_t size = 0;
  while (message.next()) {
    if (message.field() == 1) raw = message.content();
    if (message.field() == 2) size = message.value();
    if (message.field() == 3) zlib = message.content();
  }
  if (!message.is_sound()) return std::nullopt;
  if (zlib.empty()) return std::string(raw);
  if (size > kLargestBlock) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size), '\0');
  std::size_t num = 0;
  if (CPLZLibInflate(zlib.data(), zlib.size(), bytes.data(), bytes.size(), &num) == nullptr)
    return std::nullopt;
  bytes.resize(num);
  return bytes;
}

OsmCensus count_binary(VSILFILE* file) {
  VSIFSeekL(file, 0, SEEK_END);
  const auto file_bytes = static_cast<std::int64_t>(VSIFTellL(file));
  VSIFSeekL(file, 0, SEEK_SET);
  BinaryCounter counter;
  std::string bytes;
  const auto broken = [&] {
    counter.counter.census.is_whole = false;
    return counter.counter.finish();
  };
  while (read_bytes(file, 4, bytes)) {
    std::size_t size = 0;
    for (const char byte : bytes) size = size << 8 | static_cast<std::uint8_t>(byte);
    if (size > kLargestHeader || !read_bytes(file, size, bytes)) return broken();
    Message header(bytes);
    std::string kind;
    std::uint64_t blob_size = 0;
    while (header.next()) {
      if (header.field() == 1) kind = std::string(header.content());
      if (header.field() == 3) blob_size = header.value();
    }
    if (blob_size > kLargestBlock || !read_bytes(file, static_cast<std::size_t>(blob_size), bytes))
      return broken();
    const std::optional<std::string> content = unpacked(bytes);
    if (!content) return broken();
    if (kind == "OSMHeader") counter.take_header(*content);
    if (kind == "OSMData" && !counter.take_block(*content)) return broken();
    // An element that is worth its name takes more than a byte, however well it is packed.
    const OsmCensus& census = counter.counter.census;
    if (census.num_nodes + census.num_ways > file_bytes) return broken();
  }
  return counter.counter.finish();
}

OsmCensus count_now(const std::string& path) {
  const VsiFile file(VSIFOpenL(path.c_str(), "rb"));
  OsmCensus census;
  if (!file) {
    census.is_whole = false;
    return census;
  }
  // A .pbf file begins with the length of a header, below 2^16.
  char first[2] = {};
  if (VSIFReadL(first, 1, sizeof first, file.get()) != sizeof first) return census;
  VSIFSeekL(file.get(), 0, SEEK_SET);
  const bool is_binary = first[0] == 0 && first[1] == 0;
  return is_binary ? count_binary(file.get()) : count_text(file.get());
}

}  // namespace

bool OsmCensus::is_deleted(char kind, std::int64_t number) const {
  return std::binary_search(deleted.begin(), deleted.end(), std::pair(kind, number));
}

std::vector<std::pair<std::string, std::int64_t>> OsmCensus::counts() const {
  std::vector<std::pair<std::string, std::int64_t>> named;
  const auto add = [&](const char* name, std::int64_t num) {
    if (num > 0) named.emplace_back(name, num);
  };
  add("ways without nodes in the file, left out", num_ways_without_nodes);
  add("ways of which the file lacks nodes, cut short", num_ways_cut);
  add("areas of which the file lacks ways, cut or left out", num_areas_cut);
  add("elements that an editor deleted, left out", static_cast<std::int64_t>(deleted.size()));
  add("elements that were never uploaded (numbers below 0)", num_negative);
  add("nodes and ways that stand there once more, of which one is read", num_repeated);
  return named;
}

OsmCensus count_osm(const std::string& path) {
  static FileMemo<OsmCensus> memo;
  return memo.of(path, [&] { return count_now(path); });
}

}  // namespace terracast::tiler
