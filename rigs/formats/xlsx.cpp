#include <zip.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <pugixml.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/fixes/text.h"
#include "rigs/rig_table.h"

// Excel's Office Open XML (ECMA-376): a zip of XML parts. Read is the first sheet of the workbook, its cells as text.
namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

/// A sheet of a rig takes some kilobytes; beyond these a file is no rig, or means harm.
constexpr zip_uint64_t kMostPartBytes = zip_uint64_t{1} << 22;
constexpr std::size_t kMostFileBytes = std::size_t{1} << 24;
constexpr std::size_t kMostColumns = 256;
constexpr std::size_t kMostRows = 1001;
constexpr std::size_t kMostCellBytes = 1024;

/// 1980-01-01, the first day a zip can hold: the bytes do not depend on when they are written.
constexpr zip_uint16_t kFirstDay = (0 << 9) | (1 << 5) | 1;

struct ZipCloser {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};
using Archive = std::unique_ptr<zip_t, ZipCloser>;

/// A part of the workbook; nothing where there is none.
std::optional<std::string> read_part(zip_t* archive, const std::string& part,
                                     const std::string& file) {
  zip_stat_t entry;
  if (zip_stat(archive, part.c_str(), 0, &entry) != 0) return std::nullopt;
  if ((entry.valid & ZIP_STAT_SIZE) == 0 || entry.size > kMostPartBytes)
    fail(ErrorKind::Input,
         "{}: its part {} unpacks to more than {} bytes; a sheet of cameras takes far less", file,
         part, kMostPartBytes);
  const std::unique_ptr<zip_file_t, ZipCloser> stream(zip_fopen(archive, part.c_str(), 0));
  if (!stream)
    fail(ErrorKind::Input, "{}: its part {} cannot be read: {}", file, part, zip_strerror(archive));
  // What the directory says of the size is not believed: no more than that is taken.
  std::string text(entry.size, '\0');
  const zip_int64_t num_read = zip_fread(stream.get(), text.data(), entry.size);
  if (num_read < 0 || static_cast<zip_uint64_t>(num_read) != entry.size)
    fail(ErrorKind::Input, "{}: its part {} is damaged", file, part);
  return text;
}

/// pugixml expands no entities of a document's own, reads no other files, and parses without recursion.
void parse_part(const std::string& text, const std::string& part, const std::string& file,
                pugi::xml_document& document) {
  const pugi::xml_parse_result parsed = document.load_buffer(
      text.data(), text.size(), pugi::parse_default | pugi::parse_ws_pcdata_single);
  if (!parsed)
    fail(ErrorKind::Input, "{}: its part {} is no XML: {}, at byte {}", file, part,
         parsed.description(), parsed.offset);
}

/// A name without the prefix of its namespace.
std::string_view local_name(const char* name) {
  const std::string_view whole = name;
  const std::size_t colon = whole.find(':');
  return colon == std::string_view::npos ? whole : whole.substr(colon + 1);
}

pugi::xml_node child_of(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_node& child : node.children())
    if (local_name(child.name()) == name) return child;
  return {};
}

std::string attribute_of(const pugi::xml_node& node, std::string_view name) {
  for (const pugi::xml_attribute& attribute : node.attributes())
    if (local_name(attribute.name()) == name) return attribute.value();
  return {};
}

/// The text of <t>, and of the <t> of runs with formats of their own.
std::string text_of(const pugi::xml_node& item) {
  std::string text;
  for (const pugi::xml_node& child : item.children()) {
    if (local_name(child.name()) == "t") text += child.text().get();
    if (local_name(child.name()) == "r") text += child_of(child, "t").text().get();
  }
  return text;
}

/// The part that a relation of the workbook leads to.
std::string target_of(const pugi::xml_document& relations, const std::string& id) {
  for (const pugi::xml_node& relation : relations.document_element().children()) {
    if (attribute_of(relation, "Id") != id) continue;
    const std::string target = attribute_of(relation, "Target");
    return target.starts_with('/') ? target.substr(1) : "xl/" + target;
  }
  return {};
}

constexpr std::array kSheets = {
    core::KnownName{"sheet: *", "a rig is read from the first sheet of a workbook", false}};

/// The part of the first sheet; the others are counted.
std::string first_sheet(zip_t* archive, const std::string& file, core::Ledger& ledger) {
  const std::optional<std::string> workbook_text = read_part(archive, "xl/workbook.xml", file);
  const std::optional<std::string> relations_text =
      read_part(archive, "xl/_rels/workbook.xml.rels", file);
  if (!workbook_text || !relations_text)
    fail(ErrorKind::Input, "{}: a zip without xl/workbook.xml; this is no Excel workbook (.xlsx)",
         file);
  pugi::xml_document workbook, relations;
  parse_part(*workbook_text, "xl/workbook.xml", file, workbook);
  parse_part(*relations_text, "xl/_rels/workbook.xml.rels", file, relations);
  const pugi::xml_node sheets = child_of(workbook.document_element(), "sheets");
  const pugi::xml_node sheet = child_of(sheets, "sheet");
  for (const pugi::xml_node& other : sheets.children())
    if (local_name(other.name()) == "sheet" && other != sheet)
      ledger.count("sheet: " + attribute_of(other, "name"), kSheets);
  const std::string part = target_of(relations, attribute_of(sheet, "id"));
  if (part.empty()) fail(ErrorKind::Input, "{}: its workbook names no sheet", file);
  return part;
}

std::vector<std::string> shared_texts(zip_t* archive, const std::string& file) {
  std::vector<std::string> texts;
  const std::optional<std::string> text = read_part(archive, "xl/sharedStrings.xml", file);
  if (!text) return texts;
  pugi::xml_document document;
  parse_part(*text, "xl/sharedStrings.xml", file, document);
  for (const pugi::xml_node& item : document.document_element().children())
    if (local_name(item.name()) == "si") texts.push_back(text_of(item));
  return texts;
}

/// Column and row of a reference such as C12, both from 0; nothing where it is none or out of bounds.
struct CellPlace {
  std::size_t column;
  std::size_t row;
};
std::optional<CellPlace> place_of(const std::string& reference) {
  std::size_t column = 0, row = 0, at = 0;
  for (; at < reference.size() && reference[at] >= 'A' && reference[at] <= 'Z'; ++at) {
    column = column * 26 + static_cast<std::size_t>(reference[at] - 'A' + 1);
    if (column > kMostColumns) return std::nullopt;
  }
  const std::size_t num_letters = at;
  for (; at < reference.size() && reference[at] >= '0' && reference[at] <= '9'; ++at) {
    row = row * 10 + static_cast<std::size_t>(reference[at] - '0');
    if (row > kMostRows) return std::nullopt;
  }
  if (num_letters == 0 || at == num_letters || at != reference.size() || row == 0)
    return std::nullopt;
  return CellPlace{column - 1, row - 1};
}

std::string cell_text(const pugi::xml_node& cell, const std::vector<std::string>& shared,
                      const std::string& place) {
  const std::string type = attribute_of(cell, "t");
  const std::string value = child_of(cell, "v").text().get();
  if (type == "inlineStr") return text_of(child_of(cell, "is"));
  if (type == "e") fail(ErrorKind::Input, "{}: holds the error {}; mend its formula", place, value);
  if (type != "s") return value;  // a number, as text, or what a formula came to
  const std::optional<double> index = geo::number_of(value);
  if (!index || *index < 0.0 || *index >= static_cast<double>(shared.size()))
    fail(ErrorKind::Input, "{}: names shared text {}, of which there are {}", place, value,
         shared.size());
  return shared[static_cast<std::size_t>(*index)];
}

using Row = std::map<std::size_t, std::string>;

/// The cells that hold something, by row and column.
std::map<std::size_t, Row> cells_of(const pugi::xml_document& document,
                                    const std::vector<std::string>& shared,
                                    const std::string& file) {
  std::map<std::size_t, Row> rows;
  std::size_t row_number = 0;
  for (const pugi::xml_node& row : child_of(document.document_element(), "sheetData").children()) {
    if (local_name(row.name()) != "row") continue;
    ++row_number;
    std::size_t column_number = 0;
    for (const pugi::xml_node& cell : row.children()) {
      if (local_name(cell.name()) != "c") continue;
      // A cell that does not say where it is follows the one before it.
      std::string reference = attribute_of(cell, "r");
      if (reference.empty())
        reference = fmt::format("{}{}", column_letters(column_number), row_number);
      const std::optional<CellPlace> place = place_of(reference);
      if (place) {
        column_number = place->column + 1;
        row_number = place->row + 1;
      }
      const std::string where = fmt::format("{}: cell {}", file, reference.substr(0, 16));
      const std::string text = cell_text(cell, shared, where);
      if (geo::trimmed(text).empty()) continue;
      if (!place)
        fail(ErrorKind::Input, "{}: not in the first {} columns and {} rows, which are read", where,
             kMostColumns, kMostRows);
      if (text.size() > kMostCellBytes)
        fail(ErrorKind::Input, "{}: holds {} bytes; no key of a camera takes more than {}", where,
             text.size(), kMostCellBytes);
      rows[place->row][place->column] = text;
    }
  }
  return rows;
}

ImportedRig read_xlsx(const std::filesystem::path& path, const ReadOptions& options) {
  const std::string file = path.string();
  const std::vector<std::byte> bytes = core::read_file(path, kMostFileBytes);
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  const Archive archive(source == nullptr ? nullptr
                                          : zip_open_from_source(source, ZIP_RDONLY, &error));
  if (!archive) {
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    zip_source_free(source);
    fail(ErrorKind::Input, "{}: no zip archive, so no Excel workbook (.xlsx): {}", file, reason);
  }
  core::Ledger ledger;
  const std::string part = first_sheet(archive.get(), file, ledger);
  const std::optional<std::string> text = read_part(archive.get(), part, file);
  if (!text) fail(ErrorKind::Input, "{}: its sheet {} is not there", file, part);
  pugi::xml_document document;
  parse_part(*text, part, file, document);
  const std::map<std::size_t, Row> rows =
      cells_of(document, shared_texts(archive.get(), file), file);
  if (rows.empty()) fail(ErrorKind::Input, "{}: its first sheet is empty", file);

  std::size_t num_columns = 0;
  for (const auto& [number, row] : rows)
    num_columns = std::max(num_columns, row.rbegin()->first + 1);
  Sheet sheet{.file = path, .headings = {}, .rows = {}, .row_numbers = {}};
  for (const auto& [number, row] : rows) {
    std::vector<std::string> cells(num_columns);
    for (const auto& [column, cell] : row) cells[column] = cell;
    if (number == rows.begin()->first) {
      sheet.headings = std::move(cells);
    } else {
      sheet.rows.push_back(std::move(cells));
      sheet.row_numbers.push_back(number + 1);
    }
  }
  ImportedRig read = rig_of_sheet(sheet, options);
  read.ledger.merge(ledger);
  return read;
}

std::string escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else
      safe += c;
  }
  return safe;
}

constexpr const char* kXmlHead = "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n";
constexpr const char* kMain = "http://schemas.openxmlformats.org/spreadsheetml/2006/main";
constexpr const char* kRelations =
    "http://schemas.openxmlformats.org/officeDocument/2006/relationships";
constexpr const char* kPackage = "http://schemas.openxmlformats.org/package/2006";
constexpr const char* kContent = "application/vnd.openxmlformats-officedocument.spreadsheetml.";

std::string sheet_xml(const Sheet& sheet) {
  std::string text = fmt::format("{}<worksheet xmlns=\"{}\"><sheetData>", kXmlHead, kMain);
  const auto add_row = [&](std::size_t number, const std::vector<std::string>& cells) {
    text += fmt::format("<row r=\"{}\">", number);
    for (std::size_t column = 0; column < cells.size(); ++column) {
      const std::string place = fmt::format("{}{}", column_letters(column), number);
      if (geo::number_of(cells[column]))
        text += fmt::format("<c r=\"{}\"><v>{}</v></c>", place, cells[column]);
      else if (!cells[column].empty())
        text += fmt::format("<c r=\"{}\" t=\"inlineStr\"><is><t>{}</t></is></c>", place,
                            escaped(cells[column]));
    }
    text += "</row>";
  };
  add_row(1, sheet.headings);
  for (std::size_t row = 0; row < sheet.rows.size(); ++row) add_row(row + 2, sheet.rows[row]);
  return text + "</sheetData></worksheet>\n";
}

/// Name and text of each part of a workbook of one sheet.
std::vector<std::pair<std::string, std::string>> parts_of(const Sheet& sheet) {
  return {
      {"[Content_Types].xml",
       fmt::format(
           "{0}<Types xmlns=\"{1}/content-types\">"
           "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package."
           "relationships+xml\"/><Default Extension=\"xml\" ContentType=\"application/xml\"/>"
           "<Override PartName=\"/xl/workbook.xml\" ContentType=\"{2}sheet.main+xml\"/>"
           "<Override PartName=\"/xl/worksheets/sheet1.xml\" ContentType=\"{2}worksheet+xml\"/>"
           "</Types>\n",
           kXmlHead, kPackage, kContent)},
      {"_rels/.rels",
       fmt::format("{}<Relationships xmlns=\"{}/relationships\"><Relationship Id=\"rId1\" "
                   "Type=\"{}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>\n",
                   kXmlHead, kPackage, kRelations)},
      {"xl/workbook.xml",
       fmt::format("{}<workbook xmlns=\"{}\" xmlns:r=\"{}\"><sheets><sheet name=\"cameras\" "
                   "sheetId=\"1\" r:id=\"rId1\"/></sheets></workbook>\n",
                   kXmlHead, kMain, kRelations)},
      {"xl/_rels/workbook.xml.rels",
       fmt::format("{}<Relationships xmlns=\"{}/relationships\"><Relationship Id=\"rId1\" "
                   "Type=\"{}/worksheet\" Target=\"worksheets/sheet1.xml\"/></Relationships>\n",
                   kXmlHead, kPackage, kRelations)},
      {"xl/worksheets/sheet1.xml", sheet_xml(sheet)},
  };
}

void write_xlsx(const rigs::RigOptions& rig, const std::filesystem::path& path) {
  const auto parts = parts_of(sheet_of_rig(rig));
  core::write_file_by(path, [&](const std::filesystem::path& temporary) {
    int code = 0;
    Archive archive(zip_open(temporary.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &code));
    if (!archive)
      fail(ErrorKind::Io, "{}: cannot be written (libzip error {})", path.string(), code);
    for (const auto& [name, text] : parts) {
      zip_source_t* content = zip_source_buffer(archive.get(), text.data(), text.size(), 0);
      const zip_int64_t index =
          zip_file_add(archive.get(), name.c_str(), content, ZIP_FL_ENC_UTF_8);
      if (index < 0) {
        zip_source_free(content);
        fail(ErrorKind::Internal, "{}: {}: {}", path.string(), name, zip_strerror(archive.get()));
      }
      zip_file_set_dostime(archive.get(), static_cast<zip_uint64_t>(index), 0, kFirstDay, 0);
    }
    if (zip_close(archive.get()) != 0)
      fail(ErrorKind::Io, "{}: cannot be written: {}", path.string(), zip_strerror(archive.get()));
    static_cast<void>(archive.release());
  });
}

}  // namespace

RigFormatInfo xlsx_rigs() {
  return {.name = "xlsx",
          .summary = "An Excel workbook whose first sheet is a table with a row a camera.",
          .is_table = true,
          .recognises = [](const std::filesystem::path& path,
                           std::string_view) { return path.extension() == ".xlsx"; },
          .read = read_xlsx,
          .write = write_xlsx,
          .known =
              [] {
                return std::vector<core::KnownTable>{
                    {"xlsx", "headings of a sheet", known_headings()},
                    {"xlsx", "sheets of a workbook", kSheets}};
              }};
}

}  // namespace terracast::rigs
