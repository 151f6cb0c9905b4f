#include <ogrsf_frmts.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "core/atomic_file.h"
#include "tests/support/record.h"
#include "tests/tiler/crs_text.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/apart/apart_readers.h"
#include "tiler/apart/form_io.h"
#include "tiler/apart/given_dataset.h"
#include "tiler/apart/given_features.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"

// Features of formats that a process of its own reads: all that it gives is what GDAL gives here.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::GdalDatasetPtr;
using tiler::GdalErrors;

std::string bytes_of(const OGRGeometry* geometry) {
  if (geometry == nullptr) return "none";
  std::string bytes(geometry->WkbSize(), '\0');
  geometry->exportToWkb(wkbNDR, reinterpret_cast<unsigned char*>(bytes.data()), wkbVariantIso);
  return bytes;
}

void expect_same(OGRFeature& given, OGRFeature& direct) {
  EXPECT_EQ(given.GetFID(), direct.GetFID());
  ASSERT_EQ(given.GetFieldCount(), direct.GetFieldCount());
  for (int i = 0; i < direct.GetFieldCount(); ++i) {
    SCOPED_TRACE(direct.GetFieldDefnRef(i)->GetNameRef());
    EXPECT_EQ(given.IsFieldSet(i), direct.IsFieldSet(i));
    EXPECT_EQ(given.IsFieldNull(i), direct.IsFieldNull(i));
    EXPECT_STREQ(given.GetFieldAsString(i), direct.GetFieldAsString(i));
    EXPECT_EQ(given.GetFieldAsDouble(i), direct.GetFieldAsDouble(i));
  }
  EXPECT_EQ(bytes_of(given.GetGeometryRef()), bytes_of(direct.GetGeometryRef()));
}

void expect_same(OGRLayer& given, OGRLayer& direct) {
  SCOPED_TRACE(direct.GetName());
  EXPECT_STREQ(given.GetName(), direct.GetName());
  EXPECT_EQ(given.GetGeomType(), direct.GetGeomType());
  EXPECT_EQ(crs_text(given.GetSpatialRef()), crs_text(direct.GetSpatialRef()));
  if (direct.GetGeomType() != wkbNone) {
    direct.ResetReading();
    given.ResetReading();
    while (true) {
      const std::unique_ptr<OGRFeature> of_direct(direct.GetNextFeature());
      const std::unique_ptr<OGRFeature> of_given(given.GetNextFeature());
      ASSERT_EQ(of_given == nullptr, of_direct == nullptr);
      if (!of_direct) break;
      expect_same(*of_given, *of_direct);
    }
  }
  EXPECT_EQ(given.GetFeatureCount(), direct.GetFeatureCount());
  OGRFeatureDefn& fields = *direct.GetLayerDefn();
  ASSERT_EQ(given.GetLayerDefn()->GetFieldCount(), fields.GetFieldCount());
  for (int i = 0; i < fields.GetFieldCount(); ++i) {
    const OGRFieldDefn& one = *given.GetLayerDefn()->GetFieldDefn(i);
    const OGRFieldDefn& other = *fields.GetFieldDefn(i);
    EXPECT_STREQ(one.GetNameRef(), other.GetNameRef());
    EXPECT_EQ(one.GetType(), other.GetType()) << other.GetNameRef();
    EXPECT_EQ(one.GetSubType(), other.GetSubType()) << other.GetNameRef();
    EXPECT_EQ(one.GetWidth(), other.GetWidth()) << other.GetNameRef();
    EXPECT_EQ(one.GetPrecision(), other.GetPrecision()) << other.GetNameRef();
  }
}

/// As the program opens it, and as GDAL does in this process.
void expect_same_both_ways(const std::filesystem::path& file) {
  const core::Path path = path_of(file);
  const GdalErrors direct_errors;
  const GdalDatasetPtr direct = tiler::open_vectors_here(path, direct_errors);
  const GdalErrors given_errors;
  const GdalDatasetPtr given = tiler::open_gdal_vectors(path, given_errors);
  EXPECT_NE(dynamic_cast<tiler::GivenDataset*>(given.get()), nullptr) << "read in this process";
  EXPECT_STREQ(given->GetDriver()->GetDescription(), direct->GetDriver()->GetDescription());
  ASSERT_EQ(given->GetLayerCount(), direct->GetLayerCount());
  for (int i = 0; i < direct->GetLayerCount(); ++i)
    expect_same(*given->GetLayer(i), *direct->GetLayer(i));
  EXPECT_EQ(given_errors.has_failure(), direct_errors.has_failure());
  EXPECT_EQ(tiler::files_of(*given, path), tiler::files_of(*direct, path));
  EXPECT_EQ(tiler::content_hash_of(*given, path), tiler::content_hash_of(*direct, path));
}

class ApartFeatures : public testing::Test {
 protected:
  ApartFeatures() {
    tiler::register_gdal();
    register_all_drivers();
  }
};

struct Field {
  const char* name;
  OGRFieldType type;
  OGRFieldSubType subtype = OFSTNone;
};
constexpr Field kFields[] = {
    {"name", OFTString},     {"floors", OFTInteger},           {"large", OFTInteger64},
    {"height", OFTReal},     {"lit", OFTInteger, OFSTBoolean}, {"day", OFTDate},
    {"moment", OFTDateTime}, {"tags", OFTStringList},          {"levels", OFTIntegerList},
    {"widths", OFTRealList}};
constexpr const char* kShapes[] = {"POINT (1.5 42.5)", "POINT Z (1.51 42.51 812.25)",
                                   "LINESTRING (1.5 42.5, 1.6 42.55, 1.7 42.5)",
                                   "POLYGON ((1.5 42.5, 1.6 42.5, 1.6 42.6, 1.5 42.5))",
                                   "MULTIPOLYGON (((1.5 42.5, 1.6 42.5, 1.6 42.6, 1.5 42.5)),"
                                   "((2 43, 2.1 43, 2.1 43.1, 2 43)))"};

void fill(OGRFeature& feature, int number) {
  const auto set = [&](const char* name, const auto&... values) {
    const int index = feature.GetFieldIndex(name);
    if (index >= 0 && number % 3 != 2) feature.SetField(index, values...);
  };
  set("name", "Größe & \"Länge\"");
  set("floors", 3 + number);
  set("large", GIntBig{12345678901234});
  set("height", 12.0625 + number);
  set("lit", 1);
  set("day", 2024, 2, 29);
  set("moment", 2024, 2, 29, 12, 30, 15.5F, 100);
  if (number == 3)
    if (const int index = feature.GetFieldIndex("height"); index >= 0) feature.SetFieldNull(index);
}

/// Writes what a format takes of the fields and shapes.
/// returns   whether there is anything
bool write_things(const std::filesystem::path& file, GDALDriver& driver) {
  const GdalErrors quiet;
  const GdalDatasetPtr dataset(driver.Create(file.c_str(), 0, 0, 0, GDT_Unknown, nullptr));
  if (!dataset) return false;
  OGRSpatialReference crs;
  crs.SetFromUserInput("EPSG:4326");
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::string format = driver.GetDescription();
  int num_written = 0;
  // A geodatabase and others hold one kind of shape a layer.
  const bool is_strict = format == "OpenFileGDB";
  for (std::size_t shape = 0; shape < std::size(kShapes);
       shape += is_strict ? 1 : std::size(kShapes)) {
    OGRGeometry* first = nullptr;
    OGRGeometryFactory::createFromWkt(kShapes[shape], nullptr, &first);
    const std::unique_ptr<OGRGeometry> kept(first);
    const std::string name = format == "DXF"   ? "entities"
                             : format == "GPX" ? "waypoints"
                                               : fmt::format("things{}", shape);
    OGRLayer* layer = dataset->CreateLayer(name.c_str(), format == "DXF" ? nullptr : &crs,
                                           is_strict         ? kept->getGeometryType()
                                           : format == "GPX" ? wkbPoint
                                                             : wkbUnknown,
                                           nullptr);
    if (layer == nullptr) continue;
    for (const Field& field : kFields) {
      OGRFieldDefn defn(field.name, field.type);
      defn.SetSubType(field.subtype);
      layer->CreateField(&defn);
    }
    for (std::size_t i = shape; i < (is_strict ? shape + 1 : std::size(kShapes)); ++i) {
      if (format == "GPX" && i > 0) break;
      OGRFeature feature(layer->GetLayerDefn());
      OGRGeometry* geometry = nullptr;
      OGRGeometryFactory::createFromWkt(kShapes[i], nullptr, &geometry);
      feature.SetGeometryDirectly(geometry);
      fill(feature, static_cast<int>(i));
      num_written += layer->CreateFeature(&feature) == OGRERR_NONE ? 1 : 0;
    }
  }
  return num_written > 0;
}

TEST_F(ApartFeatures, GiveAllThatGdalGivesOfEveryFormatThatItWrites) {
  const ScratchFolder folder;
  struct Format {
    const char* driver;
    const char* file;
  };
  const Format formats[] = {
      {"GML", "a.gml"},          {"KML", "a.kml"},       {"LIBKML", "b.kml"},
      {"GPX", "a.gpx"},          {"DXF", "a.dxf"},       {"MapInfo File", "a.tab"},
      {"MapInfo File", "b.mif"}, {"SQLite", "a.sqlite"}, {"OpenFileGDB", "a.gdb"}};
  for (const Format& format : formats) {
    SCOPED_TRACE(format.file);
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(format.driver);
    ASSERT_NE(driver, nullptr);
    if (driver->GetMetadataItem(GDAL_DCAP_CREATE) == nullptr) continue;
    ASSERT_TRUE(write_things(folder / format.file, *driver));
    expect_same_both_ways(folder / format.file);
  }
}

TEST_F(ApartFeatures, GiveFormatsThatGdalOnlyReads) {
  const ScratchFolder folder;
  write_text(folder / "a.topojson",
             R"({"type":"Topology","transform":{"scale":[0.001,0.001],"translate":[1.5,42.5]},)"
             R"("objects":{"things":{"type":"GeometryCollection","geometries":[)"
             R"({"type":"LineString","arcs":[0],"properties":{"name":"a","height":3.5}},)"
             R"({"type":"Polygon","arcs":[[1]],"properties":{"name":"b"}}]}},)"
             R"("arcs":[[[0,0],[10,10],[5,0]],[[20,20],[10,0],[0,10],[-10,-10]]]})");
  expect_same_both_ways(folder / "a.topojson");
  write_text(folder / "a.json",
             R"({"displayFieldName":"name","geometryType":"esriGeometryPoint",)"
             R"("spatialReference":{"wkid":4326},"fields":[{"name":"name","type":)"
             R"("esriFieldTypeString","alias":"name","length":20},{"name":"n","type":)"
             R"("esriFieldTypeInteger","alias":"n"}],"features":[{"attributes":{"name":"x","n":4},)"
             R"("geometry":{"x":1.5,"y":42.5}},{"attributes":{"name":null,"n":5},"geometry":)"
             R"({"x":1.6,"y":42.6}}]})");
  expect_same_both_ways(folder / "a.json");
}

// GDAL notes the fields of a GML beside it, in files that the program has only to read.
TEST_F(ApartFeatures, LeaveNothingBesideTheFile) {
  const ScratchFolder folder;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GML");
  ASSERT_TRUE(write_things(folder / "a.gml", *driver));
  std::filesystem::remove(folder / "a.xsd");
  const GdalErrors errors;
  const GdalDatasetPtr given = tiler::open_gdal_vectors(path_of(folder / "a.gml"), errors);
  std::size_t num_read = 0;
  for (int i = 0; i < given->GetLayerCount(); ++i)
    while (const auto feature = std::unique_ptr<OGRFeature>(given->GetLayer(i)->GetNextFeature()))
      ++num_read;
  EXPECT_EQ(num_read, std::size(kShapes));
  EXPECT_FALSE(errors.has_failure()) << errors.said();
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

// SQLite keeps changes in a log beside the file, and would write there to read them.
TEST_F(ApartFeatures, OfADatabaseWithALogAreReadOrRefusedIfChangesWait) {
  const ScratchFolder folder;
  const auto file = folder / "a.sqlite";
  ASSERT_TRUE(write_things(file, *GetGDALDriverManager()->GetDriverByName("SQLite")));
  {
    // As a database that was closed with a log: the versions that its head states of reading and writing.
    std::fstream head(file, std::ios::binary | std::ios::in | std::ios::out);
    head.seekp(18);
    head << "\2\2";
  }
  const GdalErrors errors;
  const GdalDatasetPtr given = tiler::open_gdal_vectors(path_of(file), errors);
  EXPECT_FALSE(errors.has_failure()) << errors.said();
  EXPECT_EQ(given->GetLayer(0)->GetFeatureCount(), static_cast<GIntBig>(std::size(kShapes)));
  write_text(file.string() + "-wal", "changes");
  expect_error(ErrorKind::Input, {"a.sqlite: changes wait in", "wal_checkpoint"},
               [&] { tiler::open_gdal_vectors(path_of(file), errors); });
}

// With bytes wrong here and there, a file is read, or refused with its name, whatever GDAL does over it.
TEST_F(ApartFeatures, ThatAreDamagedAreReadOrRefusedByName) {
  const ScratchFolder folder;
  std::mt19937 random(20261130);
  const int num_files = is_recorded_run() ? 500 : 4;
  for (const auto& [format, name] : {std::pair{"GML", "a.gml"},
                                     {"LIBKML", "a.kml"},
                                     {"DXF", "a.dxf"},
                                     {"MapInfo File", "a.mif"},
                                     {"SQLite", "a.sqlite"},
                                     {"GPX", "a.gpx"}}) {
    ASSERT_TRUE(write_things(folder / name, *GetGDALDriverManager()->GetDriverByName(format)));
    const std::vector<std::byte> bytes = core::read_file(folder / name);
    for (int i = 0; i < num_files; ++i) {
      std::vector<std::byte> wrong = bytes;
      for (int k = 0; k < 5; ++k) wrong[random() % wrong.size()] = static_cast<std::byte>(random());
      const auto file = folder / fmt::format("wrong-{}-{}", i, name);
      core::write_file(file, wrong);
      const GdalErrors errors;
      try {
        const GdalDatasetPtr given = tiler::open_gdal_vectors(path_of(file), errors);
        for (int layer = 0; layer < given->GetLayerCount(); ++layer)
          while (const auto feature =
                     std::unique_ptr<OGRFeature>(given->GetLayer(layer)->GetNextFeature()))
            EXPECT_EQ(feature->GetDefnRef(), given->GetLayer(layer)->GetLayerDefn());
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Input) << error.what();
        EXPECT_NE(std::string(error.what()).find(file.filename().string()), std::string::npos)
            << error.what();
      }
    }
  }
}

// Archives of KML, which a library unpacks by a temporary file of its own.
TEST_F(ApartFeatures, GiveZippedKml) {
  const ScratchFolder folder;
  GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("LIBKML");
  ASSERT_TRUE(write_things(folder / "a.kmz", *driver));
  expect_same_both_ways(folder / "a.kmz");
}

TEST_F(ApartFeatures, AreReadHereInTheFormatsOfEveryDay) {
  const ScratchFolder folder;
  for (const auto& [driver, name] :
       {std::pair{"GPKG", "a.gpkg"}, {"GeoJSON", "a.geojson"}, {"FlatGeobuf", "a.fgb"}}) {
    write_vectors(folder / name, driver, {{"POINT (1.5 42.5)", {{"name", "a"}}}});
    const GdalErrors errors;
    EXPECT_EQ(dynamic_cast<tiler::GivenDataset*>(
                  tiler::open_gdal_vectors(path_of(folder / name), errors).get()),
              nullptr)
        << name;
  }
}

tiler::FeatureForm small_form() {
  tiler::FeatureForm form;
  form.format = "GML";
  form.layers.resize(2);
  form.layers[0].fields = {{.name = "height", .type = OFTReal}};
  form.layers[0].num_given = 2;
  form.layers[0].end_byte = form.layers[1].first_byte = 100;
  form.layers[1].num_given = 1;
  form.layers[1].end_byte = 150;
  return form;
}

TEST(FeatureForm, ThatDoesNotHoldTogetherIsRefused) {
  tiler::check_feature_form(small_form(), 150, "a.gml");
  const std::function<void(tiler::FeatureForm&)> wrongs[] = {
      [](auto& form) { form.layers.pop_back(); },
      [](auto& form) { form.layers[1].first_byte = 90; },
      [](auto& form) { form.layers[1].end_byte = 151; },
      [](auto& form) { form.layers[0].end_byte = ~std::uint64_t{0}; },
      [](auto& form) { form.layers[0].num_given = 13; },
      [](auto& form) { form.layers[0].num_given = -1; },
      [](auto& form) { form.layers[0].fields[0].type = OFTWideString; },
      [](auto& form) { form.layers[0].fields[0].subtype = OFSTBoolean; },
      [](auto& form) { form.layers[0].fields[0].width = -1; },
      [](auto& form) { form.layers[0].fields[0].precision = 2000000000; },
  };
  int index = 0;
  for (const auto& wrong : wrongs) {
    SCOPED_TRACE(index++);
    tiler::FeatureForm form = small_form();
    wrong(form);
    expect_error(ErrorKind::Input, {"a.gml", "damaged"},
                 [&] { tiler::check_feature_form(form, 150, "a.gml"); });
  }
}

TEST(FeatureForm, OfAFeatureCutOrWrongIsRefused) {
  OGRFeatureDefn* const fields = new OGRFeatureDefn("a");
  fields->Reference();
  for (const Field& field : kFields) {
    OGRFieldDefn defn(field.name, field.type);
    defn.SetSubType(field.subtype);
    fields->AddFieldDefn(&defn);
  }
  {
    OGRFeature feature(fields);
    fill(feature, 0);
    feature.SetFID(7);
    const int levels[] = {1, 2, 3};
    feature.SetField(feature.GetFieldIndex("levels"), 3, levels);
    const double widths[] = {1.5, 2.5};
    feature.SetField(feature.GetFieldIndex("widths"), 2, widths);
    OGRGeometry* geometry = nullptr;
    OGRGeometryFactory::createFromWkt(kShapes[4], nullptr, &geometry);
    feature.SetGeometryDirectly(geometry);
    const std::vector<std::byte> right = tiler::encode_feature(feature);
    expect_same(*tiler::decode_feature(right, fields, "a.gml"), feature);
    const GdalErrors quiet;
    for (std::size_t size = 0; size < right.size(); ++size)
      expect_error(ErrorKind::Input, {"a.gml", "damaged"},
                   [&] { tiler::decode_feature(std::span(right).first(size), fields, "a.gml"); });
    for (std::size_t at = 0; at + 4 <= right.size(); ++at) {
      std::vector<std::byte> wrong = right;
      std::fill_n(wrong.begin() + static_cast<std::ptrdiff_t>(at), 4, std::byte{0x7f});
      try {
        tiler::decode_feature(wrong, fields, "a.gml");
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Input);
      }
    }
  }
  fields->Release();
}

}  // namespace
}  // namespace terracast::test
