#include "tiler/geojson_crs.h"

#include <cpl_json.h>
#include <cpl_string.h>
#include <cpl_vsi.h>
#include <ogr_spatialref.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/error.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

/// Longer than what any system is described by.
constexpr std::size_t kLongestCrs_bytes = std::size_t{1} << 16;
constexpr std::size_t kLongestShown_bytes = 200;

/// Finds the values of members "crs" of a text's outermost object, however large that is.
class CrsMember {
 public:
  /// True: a value is whole.
  bool take(char c) {
    if (is_value_ && value_.size() < kLongestCrs_bytes) value_ += c;
    if (is_string_) {
      take_of_string(c);
      return false;
    }
    switch (c) {
      case '"':
        is_string_ = true;
        string_.clear();
        return false;
      case '{':
      case '[':
        ++depth_;
        return false;
      case '}':
      case ']':
        --depth_;
        return is_value_ && depth_ == 0;
      case ':':
        if (depth_ == 1 && is_crs()) {
          name_ = string_;
          is_value_ = true;
        }
        return false;
      default:
        return is_value_ && depth_ == 1 && c == ',';
    }
  }
  /// Once it is whole.
  std::string take_value() {
    is_value_ = false;
    std::string value = std::exchange(value_, {});
    value.pop_back();
    return value;
  }

 private:
  /// GDAL looks for it in either case, and takes the first; of those spelt alike the last replaces
  /// the ones before.
  bool is_crs() const { return name_.empty() ? EQUAL(string_.c_str(), "crs") : string_ == name_; }
  void take_of_string(char c) {
    if (is_escaped_)
      is_escaped_ = false;
    else if (c == '\\')
      is_escaped_ = true;
    else if (c == '"')
      is_string_ = false;
    else if (string_.size() < 8)
      string_ += c;
  }

  int depth_ = 0;
  bool is_string_ = false;
  bool is_escaped_ = false;
  bool is_value_ = false;
  std::string string_;  ///< the last one, or how it begins
  std::string value_;
  std::string name_;  ///< as the first is spelt
};

std::optional<std::string> crs_member_of(const std::string& path) {
  struct Closer {
    void operator()(VSILFILE* file) const { VSIFCloseL(file); }
  };
  const std::unique_ptr<VSILFILE, Closer> file(VSIFOpenL(path.c_str(), "rb"));
  if (!file) return std::nullopt;
  CrsMember member;
  std::optional<std::string> last;
  std::vector<char> bytes(std::size_t{1} << 16);
  while (const std::size_t count = VSIFReadL(bytes.data(), 1, bytes.size(), file.get()))
    for (std::size_t i = 0; i < count; ++i)
      if (member.take(bytes[i])) last = member.take_value();
  return last;
}

/// How OGR is asked for what it names; empty: in no way.
std::string name_of(const CPLJSONObject& crs) {
  const std::string type = crs.GetString("type");
  if (EQUAL(type.c_str(), "name")) return crs.GetString("properties/name");
  if (EQUAL(type.c_str(), "OGC")) return crs.GetString("properties/urn");
  const std::string code = crs.GetObj("properties/code").ToString();
  return EQUAL(type.c_str(), "EPSG") && !code.empty() ? "EPSG:" + code : "";
}

}  // namespace

void check_geojson_crs(const core::Path& file) {
  const auto text = crs_member_of(gdal_path(file));
  if (!text) return;
  CPLJSONDocument document;
  if (text->size() + 1 >= kLongestCrs_bytes || !document.LoadMemory("{\"crs\":" + *text + "}"))
    core::fail(
        core::ErrorKind::Input,
        "{}: its \"crs\" is no JSON, or longer than {} bytes; state the coordinate reference "
        "system with ogr2ogr -a_srs EPSG:…",
        file.written, kLongestCrs_bytes);
  const CPLJSONObject crs = document.GetRoot().GetObj("crs");
  if (crs.GetType() == CPLJSONObject::Type::Null) return;
  std::string shown = crs.Format(CPLJSONObject::PrettyFormat::Plain);  // asking adds members
  const std::string name = crs.GetType() == CPLJSONObject::Type::Object ? name_of(crs) : "";
  OGRSpatialReference known;
  if (!name.empty() &&
      known.SetFromUserInput(
          name.c_str(), OGRSpatialReference::SET_FROM_USER_INPUT_LIMITATIONS_get()) == OGRERR_NONE)
    return;
  if (!name.empty()) shown = name;
  if (shown.size() > kLongestShown_bytes) shown = shown.substr(0, kLongestShown_bytes) + " …";
  core::fail(core::ErrorKind::Input,
             "{}: its coordinate reference system {} is not known; state the right one with "
             "ogr2ogr -a_srs EPSG:…, or take out its \"crs\" where it is in WGS84's longitudes and "
             "latitudes",
             file.written, shown);
}

}  // namespace terracast::tiler
