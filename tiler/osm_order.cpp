#include "tiler/osm_order.h"

#include <cpl_vsi.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/error.h"
#include "core/stop.h"
#include "tiler/osm_text.h"

namespace terracast::tiler {
namespace {

constexpr const char* kWayOut = "osmium sort FILE -o SORTED.osm.pbf puts it in order";

std::string read_all(const core::Path& file, const std::string& path) {
  VSIStatBufL status;
  if (VSIStatL(path.c_str(), &status) != 0)
    core::fail(core::ErrorKind::Io, "{}: there is no such file", file.written);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (size > OrderedOsm::kMost_bytes)
    core::fail(
        core::ErrorKind::Input,
        "{}: has ways before their nodes, or elements twice, and {} bytes are too many to put in "
        "order here; {}",
        file.written, size, kWayOut);
  std::string bytes(static_cast<std::size_t>(size), '\0');
  VSILFILE* opened = VSIFOpenL(path.c_str(), "rb");
  const std::size_t num = opened == nullptr ? 0 : VSIFReadL(bytes.data(), 1, bytes.size(), opened);
  if (opened != nullptr) VSIFCloseL(opened);
  if (num != bytes.size()) core::fail(core::ErrorKind::Io, "{}: cannot be read", file.written);
  return bytes;
}

/// A whole element, from its < to its end.
struct Element {
  std::int64_t id;
  std::string_view text;
};

/// Of each kind; nothing else of the file matters.
struct Elements {
  std::array<std::vector<Element>, 3> of_kinds;  ///< nodes, ways, relations

  std::vector<Element>* find(std::string_view name) {
    return name == "node"       ? &of_kinds[0]
           : name == "way"      ? &of_kinds[1]
           : name == "relation" ? &of_kinds[2]
                                : nullptr;
  }
};

Elements elements_in(std::string_view text, const core::Path& file) {
  Elements elements;
  std::size_t begin = 0;  // of the element that is open
  bool is_open = false;
  std::int64_t id = 0;
  std::size_t num = 0;
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at)) {
    if (++num % 65536 == 0) core::throw_if_stop_asked();
    const std::size_t size = end_of_osm_element(text.substr(at + 1));
    if (size == std::string_view::npos)
      core::fail(core::ErrorKind::Input, "{}: ends in the middle of an element; fetch it again",
                 file.written);
    const std::string_view element = text.substr(at + 1, size);
    const std::size_t end = at + 1 + size + 1;
    const bool closes = element.starts_with('/');
    const std::string_view name = osm_element_name(element).substr(closes ? 1 : 0);
    if (std::vector<Element>* const kind = elements.find(name)) {
      if (!closes) {
        begin = at;
        is_open = true;
        id = osm_number_in(element, "id").value_or(0);
      }
      if (is_open && (closes || element.ends_with('/'))) {
        kind->push_back({id, text.substr(begin, end - begin)});
        is_open = false;
      }
    }
    at = end;
  }
  return elements;
}

/// Of elements that stand twice the one that says more: Overpass writes skeletons of what it has written.
void keep_one_of_each(std::vector<Element>& kind) {
  const auto says_more = [](const Element& a, const Element& b) {
    const auto has_tags = [](const Element& one) {
      return one.text.find("<tag") != std::string_view::npos;
    };
    return has_tags(a) != has_tags(b) ? has_tags(a) : a.text.size() > b.text.size();
  };
  std::vector<Element> kept;
  for (const Element& element : kind)
    if (kept.empty() || kept.back().id != element.id || element.id == 0)
      kept.push_back(element);
    else if (says_more(element, kept.back()))
      kept.back() = element;
  kind = std::move(kept);
}

/// Up to the end of <osm …>: it states the encoding, and what names stand for.
std::string head_of(std::string_view text) {
  const std::size_t begin = text.find("<osm");
  const std::size_t size = begin == std::string_view::npos
                               ? std::string_view::npos
                               : end_of_osm_element(text.substr(begin + 1));
  if (size == std::string_view::npos || text.substr(begin + 1, size).ends_with('/'))
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<osm version=\"0.6\">";
  return std::string(text.substr(0, begin + 1 + size + 1));
}

}  // namespace

OrderedOsm::OrderedOsm(const core::Path& file, const std::string& path) : written_(file.written) {
  static std::atomic<int> num_made = 0;
  const std::string text = read_all(file, path);
  Elements elements = elements_in(text, file);
  bytes_.reserve(text.size() + 128);
  bytes_ = head_of(text) + "\n";
  for (std::vector<Element>& kind : elements.of_kinds) {
    std::stable_sort(kind.begin(), kind.end(),
                     [](const Element& a, const Element& b) { return a.id < b.id; });
    keep_one_of_each(kind);
    for (const Element& element : kind) (bytes_ += element.text) += '\n';
  }
  bytes_ += "</osm>\n";
  path_ = fmt::format("{}{}.osm", kFolder, num_made++);
  VSILFILE* made = VSIFileFromMemBuffer(path_.c_str(), reinterpret_cast<GByte*>(bytes_.data()),
                                        bytes_.size(), FALSE);
  TERRACAST_CHECK(made != nullptr, "no file of {} bytes in memory", bytes_.size());
  VSIFCloseL(made);
}

OrderedOsm::~OrderedOsm() { VSIUnlink(path_.c_str()); }

}  // namespace terracast::tiler
