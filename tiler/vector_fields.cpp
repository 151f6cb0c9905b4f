#include "tiler/vector_fields.h"

#include <fmt/format.h>
#include <ogr_feature.h>

#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/json.h"
#include "tiler/vector_parts.h"

namespace terracast::tiler {
namespace {

using core::Json;
using Tags = std::vector<std::pair<std::string, std::string>>;

constexpr int kDeepest = 8;

/// A scalar as text; nullopt: it is none, or null.
std::optional<std::string> scalar_text(const Json& json) {
  if (json.is_null() || json.is_object() || json.is_array()) return std::nullopt;
  const std::string text = json.text(-1);
  if (text == "true") return "yes";
  if (text == "false") return "no";
  return text.starts_with('"') ? json.string() : text;
}

void add_json(const std::string& name, const Json& json, int depth, Tags& tags,
              std::int64_t& num_too_deep) {
  if (depth > kDeepest && (json.is_object() || json.is_array())) {
    ++num_too_deep;
    tags.emplace_back(name, json.text(-1));
    return;
  }
  if (json.is_object()) {
    for (const auto& [member, value] : json.members())
      add_json(name.empty() ? member : name + "." + member, value, depth + 1, tags, num_too_deep);
    return;
  }
  if (!json.is_array()) {
    if (const auto text = scalar_text(json)) tags.emplace_back(name, *text);
    return;
  }
  std::string list;
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (const auto text = scalar_text(json.at(i)))
      list += (list.empty() ? "" : ";") + *text;
    else
      add_json(fmt::format("{}[{}]", name, i), json.at(i), depth + 1, tags, num_too_deep);
  }
  if (!list.empty()) tags.emplace_back(name, list);
}

template <class Value>
std::string joined(const Value* values, int num) {
  std::string list;
  for (int i = 0; i < num; ++i) list += fmt::format("{}{}", i == 0 ? "" : ";", values[i]);
  return list;
}

/// The values of a field of several; nullopt: it is a field of one.
std::optional<std::string> list_text(OGRFeature& feature, int field) {
  int num = 0;
  switch (feature.GetFieldDefnRef(field)->GetType()) {
    case OFTIntegerList: {
      const int* values = feature.GetFieldAsIntegerList(field, &num);
      return joined(values, num);
    }
    case OFTInteger64List: {
      const GIntBig* values = feature.GetFieldAsInteger64List(field, &num);
      return joined(values, num);
    }
    case OFTRealList: {
      const double* values = feature.GetFieldAsDoubleList(field, &num);
      return joined(values, num);
    }
    case OFTStringList: {
      char** values = feature.GetFieldAsStringList(field);
      return joined(values, CSLCount(values));
    }
    default:
      return std::nullopt;
  }
}

bool is_json(const OGRFieldDefn& field, std::string_view text) {
  return field.GetSubType() == OFSTJSON ||
         // As other programs write objects into fields of text.
         (field.GetType() == OFTString && std::string_view(field.GetNameRef()) == "tags" &&
          text.starts_with('{'));
}

}  // namespace

Tags tags_of_fields(const OGRFeature& feature, bool is_osm, std::int64_t& num_too_deep) {
  Tags tags;
  auto& fields = const_cast<OGRFeature&>(feature);  // its getters keep texts
  for (int i = 0; i < feature.GetFieldCount(); ++i) {
    if (feature.IsFieldSetAndNotNull(i) == 0) continue;
    const OGRFieldDefn& field = *feature.GetFieldDefnRef(i);
    const std::string name = field.GetNameRef();
    const char* text = fields.GetFieldAsString(i);
    if (name == "other_tags" || name == "all_tags") {
      unpack_tags(text, tags);
    } else if (is_osm) {
      continue;
    } else if (const auto list = list_text(fields, i)) {
      tags.emplace_back(name, *list);
    } else if (field.GetSubType() == OFSTBoolean) {
      tags.emplace_back(name, fields.GetFieldAsInteger(i) != 0 ? "yes" : "no");
    } else if (is_json(field, text)) {
      std::optional<Json> json;
      try {
        json = Json::parse(text, name);
      } catch (const core::Error&) {  // text after all
      }
      if (json)
        add_json(name == "tags" && json->is_object() ? "" : name, *json, 0, tags, num_too_deep);
      else
        tags.emplace_back(name, text);
    } else {
      tags.emplace_back(name, text);
    }
  }
  return tags;
}

}  // namespace terracast::tiler
