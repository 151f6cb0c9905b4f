#include <gtest/gtest.h>
#include <zip.h>

#include "core/atomic_file.h"
#include "core/registry.h"
#include "rigs/rig_format.h"
#include "tests/rigs/shipped_rigs.h"
#include "tests/support/expect_error.h"

// Workbooks as other programs write them, and ones that mean harm.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using test::expect_error;
namespace fs = std::filesystem;

using Parts = std::vector<std::pair<std::string, std::string>>;

void write_zip(const fs::path& file, const Parts& parts) {
  int code = 0;
  zip_t* archive = zip_open(file.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code);
  ASSERT_NE(archive, nullptr);
  for (const auto& [name, text] : parts)
    ASSERT_GE(zip_file_add(archive, name.c_str(),
                           zip_source_buffer(archive, text.data(), text.size(), 0), 0),
              0);
  ASSERT_EQ(zip_close(archive), 0);
}

Parts workbook(const std::string& sheet, const std::string& shared = "") {
  Parts parts = {
      {"xl/workbook.xml",
       "<x:workbook xmlns:x=\"m\" xmlns:r=\"r\"><x:sheets><x:sheet name=\"rig\" sheetId=\"4\" "
       "r:id=\"rId7\"/>"
       "</x:sheets></x:workbook>"},
      {"xl/_rels/workbook.xml.rels",
       "<Relationships><Relationship Id=\"rId1\" Target=\"styles.xml\"/>"
       "<Relationship Id=\"rId7\" Target=\"/xl/worksheets/sheet9.xml\"/></Relationships>"},
      {"xl/worksheets/sheet9.xml", sheet},
  };
  if (!shared.empty()) parts.emplace_back("xl/sharedStrings.xml", shared);
  return parts;
}

rigs::RigOptions read_xlsx(const fs::path& file) {
  return core::find_registered(rig_formats(), "format", "xlsx").read(file, {}).rig;
}

TEST(RigXlsx, ReadsSharedTextRunsGapsAndFormulas) {
  const fs::path file = test_folder("excel") / "rig.xlsx";
  write_zip(file,
            workbook("<worksheet><sheetData>"
                     "<row r=\"3\"><c r=\"B3\" t=\"s\"><v>0</v></c><c r=\"C3\" t=\"s\"><v>1</v></c>"
                     "<c r=\"D3\" t=\"inlineStr\"><is><t>height_px</t></is></c><c r=\"E3\" "
                     "t=\"str\"><v>fx_px</v></c></row>"
                     "<row r=\"4\"/>"
                     "<row r=\"5\"><c r=\"B5\" t=\"s\"><v>2</v></c><c r=\"C5\"><v>64</v></c><c "
                     "r=\"D5\"><v>48</v></c>"
                     "<c r=\"E5\"><f>10*3</f><v>30</v></c></row>"
                     "<row><c r=\"B6\" t=\"s\"><v>3</v></c></row>"
                     "</sheetData></worksheet>",
                     "<sst><si><t>Camera</t></si><si><r><t>width</t></r><r><t>_px</t></r></"
                     "si><si><t>left</t></si>"
                     "<si><t>right</t></si></sst>"));
  const auto cameras = rigs::build_cameras({read_xlsx(file)});
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0].name, "left");
  EXPECT_EQ(cameras[1].name, "right");
  for (const auto& camera : cameras) {
    EXPECT_EQ(camera.rig, "rig");
    EXPECT_EQ(camera.intrinsics.width_px, 64);
    EXPECT_EQ(camera.intrinsics.parameters, (std::vector<double>{30.0, 30.0, 32.0, 24.0}));
  }
}

TEST(RigXlsx, DamagedAndHostileWorkbooksAreRefused) {
  const fs::path file = test_folder("hostile") / "rig.xlsx";
  const auto expect = [&](const Parts& parts, const std::vector<std::string>& words) {
    write_zip(file, parts);
    expect_error(ErrorKind::Input, words, [&] { read_xlsx(file); });
  };
  const auto cells = [](const std::string& text) {
    return workbook("<worksheet><sheetData>" + text + "</sheetData></worksheet>", "<sst/>");
  };
  core::write_file(file, "name,width_px\n");
  expect_error(ErrorKind::Input, {"no zip archive"}, [&] { read_xlsx(file); });
  expect({{"mimetype", "application/vnd.oasis.opendocument.spreadsheet"}}, {"no Excel workbook"});
  expect(workbook("<worksheet><sheetData>"), {"sheet9.xml is no XML"});
  expect(cells(""), {"first sheet is empty"});
  expect(cells("<row><c r=\"A1\" t=\"s\"><v>5</v></c></row>"), {"cell A1", "shared text 5"});
  expect(cells("<row><c r=\"A1\" t=\"e\"><v>#DIV/0!</v></c></row>"), {"cell A1", "#DIV/0!"});
  expect(cells("<row><c r=\"XFD1048576\"><v>1</v></c></row>"), {"cell XFD1048576", "256 columns"});
  expect(cells("<row><c r=\"1A\"><v>1</v></c></row>"), {"cell 1A"});
  expect(cells("<row><c r=\"A1\"><v>" + std::string(5000, '1') + "</v></c></row>"),
         {"cell A1", "5000 bytes"});
  // Some kilobytes that unpack to twenty megabytes.
  expect(workbook(std::string(20000000, ' ')), {"sheet9.xml unpacks to more than"});
  expect(workbook("<worksheet/>", std::string(20000000, ' ')),
         {"sharedStrings.xml unpacks to more than"});
  // Entities that would stand for a billion letters stay what they are: not one is expanded.
  expect(
      workbook(
          "<!DOCTYPE b [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;&a;&a;\">]><worksheet><sheetData><row>"
          "<c r=\"A1\" t=\"str\"><v>&b;&b;</v></c></row></sheetData></worksheet>"),
      {"no row below the headings"});
  std::string deep;
  for (int i = 0; i < 500000; ++i) deep += "<a>";
  expect(workbook(deep), {"no XML"});
}

}  // namespace
}  // namespace terracast::rigs
