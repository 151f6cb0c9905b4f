#include "tiler/apart/feature_form.h"

#include <cpl_string.h>
#include <ogr_feature.h>
#include <ogr_geometry.h>

#include <memory>

#include "core/error.h"
#include "tiler/apart/form_io.h"

namespace terracast::tiler {
namespace {

enum class FieldState : std::int32_t { Unset, Null, Set };

}  // namespace

template <>
inline constexpr std::int32_t kLargestOf<FieldState> = static_cast<std::int32_t>(FieldState::Set);

namespace {

struct DateForm {
  std::int16_t year = 0;
  std::array<std::uint8_t, 5> parts = {};  ///< month, day, hour, minute, flag of the time zone
  float second = 0.0F;
  template <class Visitor>
  void describe(Visitor& visit) {
    visit(year), visit(second);
    for (std::uint8_t& part : parts) visit(part);
  }
};

template <class Value>
std::vector<Value> list_of(const Value* values, int count) {
  return values == nullptr ? std::vector<Value>()
                           : std::vector<Value>(values, values + std::max(count, 0));
}

void write_value(OGRFeature& feature, int index, FormWriter& write) {
  int count = 0;
  switch (feature.GetFieldDefnRef(index)->GetType()) {
    case OFTInteger:
      return write(std::int32_t{feature.GetFieldAsInteger(index)});
    case OFTInteger64:
      return write(std::int64_t{feature.GetFieldAsInteger64(index)});
    case OFTReal:
      return write(feature.GetFieldAsDouble(index));
    case OFTIntegerList: {
      const int* values = feature.GetFieldAsIntegerList(index, &count);
      return write(list_of(values, count));
    }
    case OFTInteger64List: {
      const GIntBig* values = feature.GetFieldAsInteger64List(index, &count);
      return write(list_of(values, count));
    }
    case OFTRealList: {
      const double* values = feature.GetFieldAsDoubleList(index, &count);
      return write(list_of(values, count));
    }
    case OFTStringList: {
      std::vector<std::string> texts;
      for (char** text = feature.GetFieldAsStringList(index); text != nullptr && *text != nullptr;
           ++text)
        texts.emplace_back(*text);
      return write(texts);
    }
    case OFTBinary: {
      const GByte* bytes = feature.GetFieldAsBinary(index, &count);
      return write(list_of(bytes, count));
    }
    case OFTDate:
    case OFTTime:
    case OFTDateTime: {
      const auto& date = feature.GetRawFieldRef(index)->Date;
      return write(DateForm{.year = date.Year,
                            .parts = {date.Month, date.Day, date.Hour, date.Minute, date.TZFlag},
                            .second = date.Second});
    }
    default:
      return write(std::string(feature.GetFieldAsString(index)));
  }
}

template <class Value>
Value read_one(FormReader& read) {
  Value value{};
  read(value);
  return value;
}

void read_date(OGRFeature& feature, int index, FormReader& read) {
  const auto date = read_one<DateForm>(read);
  OGRField field = {};
  field.Date.Year = date.year;
  field.Date.Month = date.parts[0];
  field.Date.Day = date.parts[1];
  field.Date.Hour = date.parts[2];
  field.Date.Minute = date.parts[3];
  field.Date.TZFlag = date.parts[4];
  field.Date.Second = date.second;
  feature.SetField(index, &field);
}

void read_value(OGRFeature& feature, int index, FormReader& read) {
  switch (feature.GetFieldDefnRef(index)->GetType()) {
    case OFTInteger:
      return feature.SetField(index, read_one<std::int32_t>(read));
    case OFTInteger64:
      return feature.SetField(index, GIntBig{read_one<std::int64_t>(read)});
    case OFTReal:
      return feature.SetField(index, read_one<double>(read));
    case OFTIntegerList: {
      const auto values = read_one<std::vector<int>>(read);
      return feature.SetField(index, static_cast<int>(values.size()), values.data());
    }
    case OFTInteger64List: {
      const auto values = read_one<std::vector<GIntBig>>(read);
      return feature.SetField(index, static_cast<int>(values.size()), values.data());
    }
    case OFTRealList: {
      const auto values = read_one<std::vector<double>>(read);
      return feature.SetField(index, static_cast<int>(values.size()), values.data());
    }
    case OFTStringList: {
      CPLStringList texts;
      for (const std::string& text : read_one<std::vector<std::string>>(read))
        texts.AddString(text.c_str());
      return feature.SetField(index, texts.List());
    }
    case OFTBinary: {
      const auto bytes = read_one<std::vector<GByte>>(read);
      return feature.SetField(index, static_cast<int>(bytes.size()), bytes.data());
    }
    case OFTDate:
    case OFTTime:
    case OFTDateTime:
      return read_date(feature, index, read);
    default:
      return feature.SetField(index, read_one<std::string>(read).c_str());
  }
}

const char* fault_of(const FieldForm& field) {
  if (field.type < OFTInteger || field.type > OFTMaxType || field.type == OFTWideString ||
      field.type == OFTWideStringList)
    return "a field is of no type";
  if (field.subtype < OFSTNone || field.subtype > OFSTMaxSubType ||
      OGR_AreTypeSubTypeCompatible(field.type, field.subtype) == 0)
    return "a field's subtype is none of its type";
  constexpr std::int32_t kMostDigits = 1000;  // GDAL writes numbers as texts so long
  if (field.width < 0 || (field.type == OFTReal && field.width > kMostDigits))
    return "a field is narrower than nothing, or wider than any number";
  if (field.precision < 0 || field.precision > kMostDigits)
    return "a field has more digits than any number";
  return nullptr;
}

const char* fault_of(const FeatureForm& form, std::uint64_t file_bytes) {
  std::uint64_t at = 0;
  for (const LayerForm& layer : form.layers) {
    if (layer.first_byte != at || layer.end_byte < at || layer.end_byte > file_bytes)
      return "its layers do not follow each other";
    at = layer.end_byte;
    // Each feature takes a length, and more.
    if (layer.num_given < 0 || static_cast<std::uint64_t>(layer.num_given) >
                                   (layer.end_byte - layer.first_byte) / sizeof(std::uint64_t))
      return "it counts more features than it holds";
    for (const FieldForm& field : layer.fields)
      if (const char* fault = fault_of(field)) return fault;
  }
  return at == file_bytes ? nullptr : "its features are not as many as it says";
}

}  // namespace

void check_feature_form(const FeatureForm& form, std::uint64_t file_bytes,
                        const std::string& file) {
  if (const char* fault = fault_of(form, file_bytes))
    core::fail(core::ErrorKind::Input, "{}: damaged: {}; {}", file, fault, kFormWayOut);
}

std::vector<std::byte> encode_feature(const OGRFeature& const_feature) {
  auto& feature = const_cast<OGRFeature&>(const_feature);  // its getters keep texts
  world::ByteWriter out;
  FormWriter write(out);
  write(std::int64_t{feature.GetFID()});
  for (int i = 0; i < feature.GetFieldCount(); ++i) {
    const FieldState state = feature.IsFieldNull(i) != 0  ? FieldState::Null
                             : feature.IsFieldSet(i) != 0 ? FieldState::Set
                                                          : FieldState::Unset;
    write(state);
    if (state == FieldState::Set) write_value(feature, i, write);
  }
  std::vector<std::uint8_t> wkb;
  if (const OGRGeometry* geometry = feature.GetGeometryRef()) {
    wkb.resize(geometry->WkbSize());
    geometry->exportToWkb(wkbNDR, wkb.data(), wkbVariantIso);
  }
  out.put_bytes(wkb);
  const auto bytes = std::as_bytes(std::span(out.bytes()));
  return {bytes.begin(), bytes.end()};
}

std::unique_ptr<OGRFeature> decode_feature(std::span<const std::byte> bytes, OGRFeatureDefn* fields,
                                           const std::string& file) {
  world::ByteReader in({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, file,
                       kFormWayOut);
  FormReader read(in);
  auto feature = std::make_unique<OGRFeature>(fields);
  feature->SetFID(read_one<std::int64_t>(read));
  for (int i = 0; i < feature->GetFieldCount(); ++i) {
    const auto state = read_one<FieldState>(read);
    if (state == FieldState::Null)
      feature->SetFieldNull(i);
    else if (state == FieldState::Set)
      read_value(*feature, i, read);
  }
  const std::span<const std::uint8_t> wkb = in.get_bytes();
  if (!in.is_at_end()) in.refuse("a feature goes on behind its end");
  if (wkb.empty()) return feature;
  OGRGeometry* geometry = nullptr;
  std::size_t num_used = 0;
  if (OGRGeometryFactory::createFromWkb(wkb.data(), nullptr, &geometry, wkb.size(), wkbVariantIso,
                                        num_used) != OGRERR_NONE)
    in.refuse("a geometry cannot be read");
  feature->SetGeometryDirectly(geometry);
  if (num_used != wkb.size()) in.refuse("a geometry goes on behind its end");
  return feature;
}

}  // namespace terracast::tiler
