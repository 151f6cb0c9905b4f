#include <cpl_string.h>
#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <thread>

#include "core/atomic_file.h"
#include "core/stop.h"
#include "tests/support/record.h"
#include "tests/tiler/crs_text.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/apart/given_dataset.h"
#include "tiler/apart/given_raster.h"
#include "tiler/apart/kept_forms.h"
#include "tiler/gdal_formats.h"
#include "tiler/gdal_support.h"
#include "tiler/raster_ledger.h"

// Rasters of formats that a process of its own reads: all that it gives is what GDAL gives here.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::GdalDatasetPtr;
using tiler::GdalErrors;

constexpr int kWidth = 70;
constexpr int kHeight = 45;

/// What a format may be able to hold, or not.
struct Content {
  const char* name;
  int num_bands;
  GDALDataType type;
  const char* crs;
  std::array<double, 6> geotransform;
  int width = kWidth;
  int height = kHeight;
};

const Content kContents[] = {
    {"heights", 1, GDT_Float32, "EPSG:32631", {376000.0, 30.0, 0.0, 4707000.0, 0.0, -30.0}},
    {"degrees", 1, GDT_Int16, "EPSG:4326", {1.4, 0.001, 0.0, 42.6, 0.0, -0.001}},
    {"colours", 3, GDT_Byte, "EPSG:32631", {376000.0, 30.0, 0.0, 4707000.0, 0.0, -30.0}},
    {"tinted", 4, GDT_Byte, "EPSG:32631", {376000.0, 30.0, 0.0, 4707000.0, 0.0, -30.0}},
    {"codes", 1, GDT_Byte, "EPSG:4326", {1.4, 0.001, 0.0, 42.6, 0.0, -0.001}},
    {"compound", 1, GDT_Float64, "EPSG:32631+5773", {376000.0, 25.0, 0.0, 4707000.0, 0.0, -25.0}},
    // As DTED of level 1 has it: centres on the degrees.
    {"cell",
     1,
     GDT_Int16,
     "EPSG:4326",
     {1.0 - 1.0 / 2400.0, 1.0 / 1200.0, 0.0, 43.0 + 1.0 / 2400.0, 0.0, -1.0 / 1200.0},
     1201,
     1201}};

GdalDatasetPtr make(const Content& content) {
  GdalDatasetPtr made(GetGDALDriverManager()->GetDriverByName("MEM")->Create(
      "", content.width, content.height, content.num_bands, content.type, nullptr));
  OGRSpatialReference crs;
  crs.SetFromUserInput(content.crs);
  crs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  made->SetSpatialRef(&crs);
  std::array<double, 6> geotransform = content.geotransform;
  made->SetGeoTransform(geotransform.data());
  made->SetMetadataItem("AREA_OR_POINT", "Point");
  made->SetMetadataItem("SURVEY", "by foot");
  for (int number = 1; number <= content.num_bands; ++number) {
    GDALRasterBand& band = *made->GetRasterBand(number);
    std::vector<double> row(static_cast<std::size_t>(content.width));
    for (int y = 0; y < content.height; ++y) {
      for (int x = 0; x < content.width; ++x)
        row[static_cast<std::size_t>(x)] =
            10 + (x * 7 + y * 3 + number * 11) % 200 + (content.type == GDT_Float32 ? 0.25 : 0.0);
      if (y == 4 && content.num_bands == 1) row[6] = 3.0;
      EXPECT_EQ(band.RasterIO(GF_Write, 0, y, content.width, 1, row.data(), content.width, 1,
                              GDT_Float64, 0, 0, nullptr),
                CE_None);
    }
    band.SetDescription("ground");
    band.SetMetadataItem("LAYER_TYPE", "athematic");
    if (content.num_bands >= 3) {
      band.SetColorInterpretation(static_cast<GDALColorInterp>(GCI_RedBand + number - 1));
      continue;
    }
    band.SetNoDataValue(3.0);
    if (content.type != GDT_Byte) {
      band.SetUnitType("ft");
      band.SetScale(0.5);
      band.SetOffset(100.0);
      continue;
    }
    GDALColorTable colours;
    for (int i = 0; i < 256; ++i) {
      const GDALColorEntry entry{static_cast<short>(i), static_cast<short>(255 - i), 7, 255};
      colours.SetColorEntry(i, &entry);
    }
    band.SetColorTable(&colours);
    CPLStringList names;
    for (const char* name : {"water", "forest", "rock"}) names.AddString(name);
    band.SetCategoryNames(names.List());
  }
  return made;
}

std::vector<std::string> texts(char** list) {
  std::vector<std::string> all;
  for (; list != nullptr && *list != nullptr; ++list) all.emplace_back(*list);
  return all;
}

/// In no order, which GDAL states none for.
std::vector<std::string> sorted_texts(char** list) {
  std::vector<std::string> all = texts(list);
  std::sort(all.begin(), all.end());
  return all;
}

std::map<std::string, std::vector<std::string>> metadata_of(GDALMajorObject& object) {
  std::map<std::string, std::vector<std::string>> all;
  const CPLStringList domains(object.GetMetadataDomainList(), TRUE);
  all[""] = sorted_texts(object.GetMetadata(""));
  for (int i = 0; i < domains.Count(); ++i)
    if (const auto items = sorted_texts(object.GetMetadata(domains[i])); !items.empty())
      all[domains[i]] = items;
  return all;
}

/// Empty where GDAL cannot read them all: it does not read all that it writes.
std::vector<std::byte> samples_of(GDALRasterBand& band) {
  const GdalErrors quiet;
  const int size = GDALGetDataTypeSizeBytes(band.GetRasterDataType());
  std::vector<std::byte> samples(static_cast<std::size_t>(band.GetXSize()) *
                                 static_cast<std::size_t>(band.GetYSize()) *
                                 static_cast<std::size_t>(size));
  if (band.RasterIO(GF_Read, 0, 0, band.GetXSize(), band.GetYSize(), samples.data(),
                    band.GetXSize(), band.GetYSize(), band.GetRasterDataType(), 0, 0,
                    nullptr) != CE_None)
    samples.clear();
  return samples;
}

template <class Get>
std::string declared(const Get& get) {
  int is_declared = FALSE;
  const auto value = get(&is_declared);
  return is_declared != FALSE ? fmt::format("{}", value) : "not";
}

std::string colours_of(const GDALColorTable* table) {
  if (table == nullptr) return "none";
  std::string text = fmt::format("{}", static_cast<int>(table->GetPaletteInterpretation()));
  for (int i = 0; i < table->GetColorEntryCount(); ++i) {
    const GDALColorEntry& entry = *table->GetColorEntry(i);
    text += fmt::format(" {},{},{},{}", entry.c1, entry.c2, entry.c3, entry.c4);
  }
  return text;
}

void expect_same(GDALRasterBand& given, GDALRasterBand& direct) {
  EXPECT_EQ(given.GetRasterDataType(), direct.GetRasterDataType());
  std::array<int, 4> sizes = {};
  given.GetBlockSize(&sizes[0], &sizes[1]);
  direct.GetBlockSize(&sizes[2], &sizes[3]);
  EXPECT_EQ(sizes[0], sizes[2]);
  EXPECT_EQ(sizes[1], sizes[3]);
  EXPECT_STREQ(given.GetDescription(), direct.GetDescription());
  EXPECT_STREQ(given.GetUnitType(), direct.GetUnitType());
  const auto facts = [](GDALRasterBand& band) {
    return declared([&](int* is) { return band.GetNoDataValue(is); }) + " " +
           declared([&](int* is) { return band.GetScale(is); }) + " " +
           declared([&](int* is) { return band.GetOffset(is); }) + " " +
           fmt::format("{} {} {} {} {}", static_cast<int>(band.GetColorInterpretation()),
                       band.GetMaskFlags(), band.GetOverviewCount(),
                       band.GetDefaultRAT() != nullptr, band.GetCategoryNames() != nullptr);
  };
  EXPECT_EQ(facts(given), facts(direct));
  EXPECT_EQ(colours_of(given.GetColorTable()), colours_of(direct.GetColorTable()));
  EXPECT_EQ(texts(given.GetCategoryNames()), texts(direct.GetCategoryNames()));
  EXPECT_EQ(metadata_of(given), metadata_of(direct));
  EXPECT_EQ(samples_of(given), samples_of(direct));
  EXPECT_EQ(samples_of(*given.GetMaskBand()), samples_of(*direct.GetMaskBand()));
}

void expect_same(GDALDataset& given, GDALDataset& direct, const core::Path& file) {
  EXPECT_NE(dynamic_cast<tiler::GivenDataset*>(&given), nullptr) << "read in this process";
  EXPECT_STREQ(given.GetDriver()->GetDescription(), direct.GetDriver()->GetDescription());
  ASSERT_EQ(given.GetRasterCount(), direct.GetRasterCount());
  ASSERT_EQ(given.GetRasterXSize(), direct.GetRasterXSize());
  ASSERT_EQ(given.GetRasterYSize(), direct.GetRasterYSize());
  std::array<double, 6> places = {};
  std::array<double, 6> direct_places = {};
  EXPECT_EQ(given.GetGeoTransform(places.data()), direct.GetGeoTransform(direct_places.data()));
  EXPECT_EQ(places, direct_places);
  EXPECT_EQ(crs_text(given.GetSpatialRef()), crs_text(direct.GetSpatialRef()));
  EXPECT_EQ(given.GetGCPCount(), direct.GetGCPCount());
  EXPECT_EQ(metadata_of(given), metadata_of(direct));
  EXPECT_EQ(tiler::files_of(given, file), tiler::files_of(direct, file));
  EXPECT_EQ(tiler::content_hash_of(given, file), tiler::content_hash_of(direct, file));
  EXPECT_EQ(tiler::ledger_of(given, {.what = "heights"}).json().text(),
            tiler::ledger_of(direct, {.what = "heights"}).json().text());
  for (int band = 1; band <= direct.GetRasterCount(); ++band)
    expect_same(*given.GetRasterBand(band), *direct.GetRasterBand(band));
}

/// As the program opens it, and as GDAL does in this process.
void expect_same_both_ways(const std::filesystem::path& file) {
  const core::Path path = path_of(file);
  const GdalErrors errors;
  // What GDAL says of a reference system depends on those that it has seen.
  OSRCleanup();
  const GdalErrors direct_errors;
  const GdalDatasetPtr direct = tiler::open_raster_here(path, direct_errors);
  const std::string direct_said = direct_errors.said();
  const GdalErrors given_errors;
  const GdalDatasetPtr given = tiler::open_gdal_raster(path, given_errors);
  EXPECT_EQ(given_errors.said(), direct_said);
  expect_same(*given, *direct, path);
}

class ApartRasters : public testing::Test {
 protected:
  ApartRasters() {
    tiler::register_gdal();
    register_all_drivers();
  }
};

std::string extension_of(GDALDriver& driver) {
  const char* const all = driver.GetMetadataItem(GDAL_DMD_EXTENSIONS);
  const std::string list = all == nullptr ? "" : all;
  return list.empty() ? "dat" : list.substr(0, list.find(' '));
}

char** options_for(std::string_view format) {
  static const char* terragen[] = {"MINUSERPIXELVALUE=0", "MAXUSERPIXELVALUE=300", nullptr};
  return format == "Terragen" ? const_cast<char**>(terragen) : nullptr;
}

TEST_F(ApartRasters, GiveAllThatGdalGivesOfEveryFormatThatItWrites) {
  const ScratchFolder folder;
  std::set<std::string> written;
  for (const Content& content : kContents) {
    const GdalDatasetPtr made = make(content);
    for (const char* const* format = tiler::kRasterFormats; *format != nullptr; ++format) {
      const auto is_trodden = [&] {
        for (const char* const* one = tiler::kTroddenRasters; *one != nullptr; ++one)
          if (std::strcmp(*one, *format) == 0) return true;
        return false;
      }();
      GDALDriver* driver = GetGDALDriverManager()->GetDriverByName(*format);
      // Large contents are for the format that has none else.
      const bool is_meant = content.width == kWidth || std::strcmp(*format, "DTED") == 0;
      if (is_trodden || !is_meant || driver == nullptr) continue;
      SCOPED_TRACE(fmt::format("{} of {}", content.name, *format));
      const auto file =
          folder / fmt::format("{}-{}.{}", content.name, *format, extension_of(*driver));
      {
        const GdalErrors quiet;
        const GdalDatasetPtr copy(driver->CreateCopy(file.c_str(), made.get(), FALSE,
                                                     options_for(*format), nullptr, nullptr));
        if (!copy) continue;
      }
      {
        const GdalErrors quiet;
        const GdalDatasetPtr read_again(
            GDALDataset::Open(file.c_str(), GDAL_OF_RASTER, tiler::kRasterFormats));
        if (!read_again) continue;  // some write what they do not read
      }
      written.insert(*format);
      expect_same_both_ways(file);
    }
  }
  const std::set<std::string> expected = {
      "AAIGrid",     "BMP",   "BT",   "BYN",    "DTED",     "EHdr", "ENVI",
      "GIF",         "GS7BG", "GSAG", "GSBG",   "GTX",      "HF2",  "HFA",
      "JP2OpenJPEG", "RST",   "SAGA", "SIGDEM", "Terragen", "XYZ",  "ZMap"};
  for (const std::string& format : expected) EXPECT_TRUE(written.contains(format)) << format;
}

TEST_F(ApartRasters, GiveFormatsThatGdalOnlyReads) {
  const ScratchFolder folder;
  std::string rows;
  for (int i = 0; i < 12; ++i) rows += fmt::format("{} {} *\n", 500 + i, 600.5 + i);
  write_text(folder / "grass.txt",
             "north: 42.56\nsouth: 42.44\neast: 1.53\nwest: 1.47\nrows: 12\ncols: 3\n" + rows);
  expect_same_both_ways(folder / "grass.txt");
}

TEST_F(ApartRasters, GiveMasksAndNotesBesideTheFile) {
  const ScratchFolder folder;
  const GdalDatasetPtr made = make(kContents[0]);
  const auto file = folder / "masked.bil";
  {
    const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName("EHdr")->CreateCopy(
        file.c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    ASSERT_TRUE(copy);
    copy->GetRasterBand(1)->DeleteNoDataValue();
    copy->SetMetadataItem("kind", "masked");
    ASSERT_EQ(copy->CreateMaskBand(GMF_PER_DATASET), CE_None);
    std::vector<std::uint8_t> mask(kWidth * kHeight);
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i % 3 == 0 ? 255 : 0;
    ASSERT_EQ(
        copy->GetRasterBand(1)->GetMaskBand()->RasterIO(
            GF_Write, 0, 0, kWidth, kHeight, mask.data(), kWidth, kHeight, GDT_Byte, 0, 0, nullptr),
        CE_None);
  }
  ASSERT_TRUE(std::filesystem::exists(file.string() + ".msk"));
  expect_same_both_ways(file);
}

std::string vrt_of(const std::string& name, int width, int height) {
  return fmt::format(
      "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\"><SRS>EPSG:32631</SRS><GeoTransform>"
      "376000, 30, 0, 4707000, 0, -30</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\">"
      "<SimpleSource><SourceFilename relativeToVRT=\"1\">{}</SourceFilename><SourceBand>1"
      "</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>",
      width, height, name);
}

/// A VRT is read where all that it names may be read.
TEST_F(ApartRasters, GoApartWithAVrtThatNamesThem) {
  const ScratchFolder folder;
  const GdalDatasetPtr made = make(kContents[0]);
  for (const auto& [driver, name] : {std::pair{"AAIGrid", "rare.asc"}, {"GTiff", "often.tif"}}) {
    const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName(driver)->CreateCopy(
        (folder / name).c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    ASSERT_TRUE(copy) << driver;
  }
  write_text(folder / "rare.vrt", vrt_of("rare.asc", kWidth, kHeight));
  write_text(folder / "outer.vrt", vrt_of("rare.vrt", kWidth, kHeight));
  write_text(folder / "often.vrt", vrt_of("often.tif", kWidth, kHeight));
  write_text(folder / "absent.vrt", vrt_of("absent.tif", kWidth, kHeight));
  expect_same_both_ways(folder / "rare.vrt");
  expect_same_both_ways(folder / "outer.vrt");
  const GdalErrors errors;
  for (const char* name : {"often.vrt", "often.tif", "absent.vrt"})
    EXPECT_EQ(dynamic_cast<tiler::GivenDataset*>(
                  tiler::open_gdal_raster(path_of(folder / name), errors).get()),
              nullptr)
        << name;
}

TEST_F(ApartRasters, OfAVrtThatIsTooLongAreRefusedWithTheLimit) {
  const ScratchFolder folder;
  const auto file = write_text(folder / "long.vrt", vrt_of("rare.asc", kWidth, kHeight));
  std::filesystem::resize_file(file, (1 << 26) + 1);
  const GdalErrors errors;
  expect_error(ErrorKind::Input, {"long.vrt", "67108865 bytes", "67108864", "gdalbuildvrt"},
               [&] { tiler::open_gdal_raster(path_of(file), errors); });
}

// GDAL reads Erdas' notes beside rasters of any format, and they may say where a raster lies.
TEST_F(ApartRasters, GoApartWithNotesInARareFormat) {
  const ScratchFolder folder;
  const GdalDatasetPtr made = make(kContents[0]);
  {
    const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName("GTiff")->CreateCopy(
        (folder / "often.tif").c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    const GdalDatasetPtr notes(GetGDALDriverManager()->GetDriverByName("HFA")->CreateCopy(
        (folder / "often.aux").c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    ASSERT_TRUE(copy && notes);
  }
  expect_same_both_ways(folder / "often.tif");
}

TEST_F(ApartRasters, AreReadOnceAndAgainWhenTheirFilesChange) {
  const ScratchFolder folder;
  const GdalDatasetPtr made = make(kContents[0]);
  const auto file = folder / "grid.asc";
  const auto write = [&] {
    const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName("AAIGrid")->CreateCopy(
        file.c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    ASSERT_TRUE(copy);
  };
  write();
  const GdalErrors errors;
  const auto first_sample = [&] {
    float sample = 0.0F;
    const GdalDatasetPtr dataset = tiler::open_gdal_raster(path_of(file), errors);
    EXPECT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, 1, 1, &sample, 1, 1, GDT_Float32,
                                                  0, 0, nullptr),
              CE_None);
    return sample;
  };
  std::vector<float> samples(8);
  std::vector<std::thread> threads;
  for (float& sample : samples) threads.emplace_back([&] { sample = first_sample(); });
  for (std::thread& thread : threads) thread.join();
  for (const float sample : samples) EXPECT_EQ(sample, 21.25F);
  float other = 77.0F;
  ASSERT_EQ(made->GetRasterBand(1)->RasterIO(GF_Write, 0, 0, 1, 1, &other, 1, 1, GDT_Float32, 0, 0,
                                             nullptr),
            CE_None);
  write();
  EXPECT_EQ(first_sample(), 77.0F);
}

TEST(KeptForms, AreOfAFileAndOfThoseOfItsNameWithOtherEndings) {
  const ScratchFolder folder;
  const core::Path file = path_of(folder / "grid.asc");
  write_text(folder / "grid.asc", "a");
  const std::string before = tiler::state_of_files(file, {});
  write_text(folder / "grids.asc", "b");
  std::filesystem::create_directories(folder / "grid_out");
  std::filesystem::create_directories(folder / "grid.out");
  EXPECT_EQ(tiler::state_of_files(file, {}), before);
  write_text(folder / "grid.prj", "c");
  EXPECT_NE(tiler::state_of_files(file, {}), before);
}

/// Samples that a file lacks fail where they are read, as they do here, and others are read.
TEST_F(ApartRasters, OfWhichSomethingIsMissingFailWhereItIsRead) {
  const ScratchFolder folder;
  const GdalDatasetPtr made = make(kContents[0]);
  const auto file = folder / "cut.bil";
  {
    const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName("EHdr")->CreateCopy(
        file.c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
    ASSERT_TRUE(copy);
  }
  std::filesystem::resize_file(file, 30 * kWidth * sizeof(float));
  const GdalErrors errors;
  const auto what_fails = [&](GDALDataset& dataset, int row) {
    const GdalErrors said;
    float sample = 0.0F;
    return dataset.GetRasterBand(1)->RasterIO(GF_Read, 3, row, 1, 1, &sample, 1, 1, GDT_Float32, 0,
                                              0, nullptr) == CE_None
               ? "nothing"
               : said.said().substr(0, 20);
  };
  const GdalDatasetPtr direct = tiler::open_raster_here(path_of(file), errors);
  const GdalDatasetPtr given = tiler::open_gdal_raster(path_of(file), errors);
  for (const int row : {0, 29, 30, 44})
    EXPECT_EQ(what_fails(*given, row), what_fails(*direct, row)) << row;
  EXPECT_EQ(what_fails(*given, 29), "nothing");
  EXPECT_NE(what_fails(*given, 44), "nothing");
}

TEST_F(ApartRasters, ThatAreNoFilesAreRefused) {
  const ScratchFolder folder;
  const auto pipe = folder / "pipe.asc";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const GdalErrors errors;
  for (const std::filesystem::path& file : {pipe, std::filesystem::path("/dev/zero")}) {
    expect_error(ErrorKind::Input, {file.string(), "a pipe or a device"},
                 [&] { tiler::open_gdal_raster(path_of(file), errors); });
    expect_error(ErrorKind::Input, {file.string(), "a pipe or a device"},
                 [&] { tiler::open_gdal_vectors(path_of(file), errors); });
  }
}

/// A grid whose reader waits for ever: what lies beside it is a pipe that nobody writes into.
std::filesystem::path write_waiting_grid(const ScratchFolder& folder) {
  const auto file = write_text(
      folder / "waits.asc", "ncols 2\nnrows 2\nxllcorner 1\nyllcorner 42\ncellsize 1\n1 2\n3 4\n");
  const auto pipe = folder / "waits.prj";
  EXPECT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  return file;
}

/// Processes that read apart for this one.
std::vector<pid_t> readers_of_this_process() {
  std::vector<pid_t> readers;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream words(entry.path() / "cmdline", std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(words), {}};
    std::ifstream status(entry.path() / "stat");
    const std::string stat{std::istreambuf_iterator<char>(status), {}};
    const std::size_t behind_name = stat.rfind(')');
    if (text.find("--read-apart") == std::string::npos || behind_name == std::string::npos)
      continue;
    if (std::stoi(stat.substr(behind_name + 4)) == ::getpid()) readers.push_back(std::stoi(name));
  }
  return readers;
}

TEST_F(ApartRasters, WhoseReaderEndsBySignalAreErrorsThatNameThem) {
  const ScratchFolder folder;
  const auto file = write_waiting_grid(folder);
  std::atomic<bool> is_over = false;
  std::thread killer([&] {
    while (!is_over) {
      for (const pid_t reader : readers_of_this_process()) ::kill(reader, SIGSEGV);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  });
  const GdalErrors errors;
  expect_error(ErrorKind::Input, {"waits.asc", "was ended by signal 11"},
               [&] { tiler::open_gdal_raster(path_of(file), errors); });
  is_over = true;
  killer.join();
}

TEST_F(ApartRasters, WhoseReaderTakesTooMuchAreErrorsThatNameThem) {
  const ScratchFolder folder;
  const auto waiting = path_of(write_waiting_grid(folder));
  expect_error(ErrorKind::Input, {"waits.asc", "takes more than 0.5 s"},
               [&] { tiler::read_raster_apart(waiting, {.longest_s = 0.5}); });
  // Rows of 40 MB each.
  constexpr int kColumns = 10'000'000;
  write_text(folder / "wide.hdr",
             fmt::format("NROWS 2\nNCOLS {}\nNBANDS 1\nNBITS 32\nPIXELTYPE FLOAT\nBYTEORDER I\n"
                         "LAYOUT BIL\nULXMAP 1\nULYMAP 42\nXDIM 0.000001\nYDIM 0.000001\n",
                         kColumns));
  const auto wide = write_text(folder / "wide.bil", "");
  std::filesystem::resize_file(wide, std::uintmax_t{8} * kColumns);
  expect_error(ErrorKind::Input, {"wide.bil", "allocate"}, [&] {
    tiler::read_raster_apart(path_of(wide),
                             {.limits = {.memory_bytes = 32 << 20, .file_bytes = 200'000'000}});
  });
  expect_error(
      ErrorKind::Input, {"wide.bil", "more is made of it than a temporary file may hold"},
      [&] { tiler::read_raster_apart(path_of(wide), {.limits = {.file_bytes = 50'000'000}}); });
}

TEST_F(ApartRasters, AStopEndsTheReading) {
  const ScratchFolder folder;
  const auto file = write_waiting_grid(folder);
  using Clock = std::chrono::steady_clock;
  Clock::time_point asked;
  std::thread asker([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    asked = Clock::now();
    core::ask_to_stop();
  });
  const GdalErrors errors;
  expect_error(ErrorKind::Interrupted, {}, [&] { tiler::open_gdal_raster(path_of(file), errors); });
  asker.join();
  core::forget_stop();
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - asked).count(), 2.0);
}

TEST_F(ApartRasters, LargerThanMayBeUnpackedAreRefusedWithAWayOut) {
  const ScratchFolder folder;
  write_text(folder / "vast.hdr",
             "NROWS 300000\nNCOLS 300000\nNBANDS 1\nNBITS 8\nBYTEORDER I\nLAYOUT BIL\n"
             "ULXMAP 1\nULYMAP 42\nXDIM 0.00001\nYDIM 0.00001\n");
  write_text(folder / "vast.bil", "");
  std::filesystem::resize_file(folder / "vast.bil", 90'000'000'000);  // without a block on the disk
  const GdalErrors errors;
  expect_error(ErrorKind::Input, {"vast.bil", "90 GB", "68.7 GB", "gdal_translate"},
               [&] { tiler::open_gdal_raster(path_of(folder / "vast.bil"), errors); });
}

// With bytes wrong here and there, a file is read, or refused with its name, whatever GDAL does over it.
TEST_F(ApartRasters, ThatAreDamagedAreReadOrRefusedByName) {
  const ScratchFolder folder;
  std::mt19937 random(20261130);
  const int num_files = is_recorded_run() ? 500 : 4;
  const GdalDatasetPtr made = make(kContents[1]);
  for (const char* format : {"HFA", "GSBG", "ENVI", "SAGA", "JP2OpenJPEG", "USGSDEM"}) {
    const auto right =
        folder / fmt::format("right.{}", std::strcmp(format, "SAGA") == 0 ? "sdat" : "dat");
    {
      const GdalErrors quiet;
      const GdalDatasetPtr copy(GetGDALDriverManager()->GetDriverByName(format)->CreateCopy(
          right.c_str(), made.get(), FALSE, nullptr, nullptr, nullptr));
      ASSERT_TRUE(copy) << format;
    }
    const std::vector<std::byte> bytes = core::read_file(right);
    for (int i = 0; i < num_files; ++i) {
      std::vector<std::byte> wrong = bytes;
      for (int k = 0; k < 20; ++k)
        wrong[random() % std::min<std::size_t>(wrong.size(), i % 2 == 0 ? 600 : 1 << 30)] =
            static_cast<std::byte>(random());
      const auto file = folder / fmt::format("wrong-{}-{}.dat", format, i);
      core::write_file(file, wrong);
      const GdalErrors errors;
      try {
        const GdalDatasetPtr given = tiler::open_gdal_raster(path_of(file), errors);
        for (int band = 1; band <= given->GetRasterCount(); ++band)
          if (given->GetRasterXSize() <= kWidth && given->GetRasterYSize() <= kHeight)
            samples_of(*given->GetRasterBand(band));
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::Input) << error.what();
        EXPECT_NE(std::string(error.what()).find(file.filename().string()), std::string::npos)
            << error.what();
      }
    }
  }
}

}  // namespace
}  // namespace terracast::test
