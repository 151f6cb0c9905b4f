#include "batch/dataset/croissant.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <set>

#include "batch/dataset/index.h"
#include "batch/dataset/licence.h"
#include "batch/dataset/reading.h"
#include "batch/dataset/url_path.h"
#include "core/printable.h"

namespace terracast::batch {

namespace {

using core::Json;

/// What the short names of the rest stand for: schema.org's where nothing else is said.
Json context() {
  Json context =
      Json::object()
          .set("@language", "en")
          .set("@vocab", "https://schema.org/")
          .set("cr", "http://mlcommons.org/croissant/")
          .set("dct", "http://purl.org/dc/terms/")
          .set("sc", "https://schema.org/")
          .set("conformsTo", "dct:conformsTo")
          .set("data", Json::object().set("@id", "cr:data").set("@type", "@json"))
          .set("dataType", Json::object().set("@id", "cr:dataType").set("@type", "@vocab"))
          .set("examples", Json::object().set("@id", "cr:examples").set("@type", "@json"));
  for (const char* name :
       {"citeAs",      "column",        "equivalentProperty", "excludes",   "extract",
        "field",       "fileObject",    "fileProperty",       "fileSet",    "format",
        "includes",    "isLiveDataset", "jsonPath",           "key",        "md5",
        "parentField", "path",          "recordSet",          "references", "regex",
        "repeated",    "replace",       "separator",          "source",     "subField",
        "transform"})
    context.set(name, fmt::format("cr:{}", name));
  return context;
}

Json reference(std::string_view id) { return Json::object().set("@id", id); }

/// Lines of a text, each core::printable().
std::string printable_lines(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    result += core::printable(text.substr(0, end));
    if (end < text.size()) result += "\n";
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

/// Pages of licences that have one, else the words in which they are stated.
Json licences(const DatasetFacts& facts) {
  const Publication& publication = facts.publication;
  Json list = Json::array();
  const auto add = [&](const std::string& licence, const std::string& url) {
    const std::string page = url.empty() ? licence_names(licence).url : url;
    if (page.empty())
      list.push(
          Json::object().set("@type", "sc:CreativeWork").set("name", core::printable(licence)));
    else
      list.push(core::printable(page));
  };
  if (!publication.licence.empty() || !publication.licence_url.empty()) {
    add(publication.licence, publication.licence_url);
    return list;
  }
  std::set<std::string> sources;
  for (const PlaceFacts& place : facts.places)
    sources.insert(place.licences.begin(), place.licences.end());
  sources.erase("");
  for (const std::string& licence : sources) add(licence, "");
  return list;
}

std::string description(const DatasetFacts& facts) {
  if (!facts.publication.description.empty()) return printable_lines(facts.publication.description);
  return fmt::format("{} sequences of ray-cast aerial images with exact depth and poses.",
                     facts.sequences.size());
}

/// Files that stand alone. A file that holds this one's checksum cannot have its own here.
Json file_objects(const DatasetFacts& facts, const std::set<std::string>& formats) {
  std::vector<const FileFacts*> files;
  for (const FileFacts& file : facts.files) {
    const std::size_t slash = file.path.find('/');
    if (slash == std::string::npos || !formats.contains(file.path.substr(0, slash)))
      files.push_back(&file);
  }
  std::sort(files.begin(), files.end(),
            [](const FileFacts* a, const FileFacts* b) { return a->path < b->path; });
  Json list = Json::array();
  for (const FileFacts* file : files) {
    std::string extension = std::filesystem::path(file->path).extension().string();
    if (!extension.empty()) extension.erase(0, 1);
    list.push(Json::object()
                  .set("@type", "cr:FileObject")
                  .set("@id", core::printable(file->path))
                  .set("name", core::printable(file->path))
                  .set("contentUrl", url_path(file->path))
                  .set("contentSize", fmt::format("{} B", file->num_bytes))
                  .set("encodingFormat", mime_type(extension))
                  .set("sha256", file->sha256));
  }
  return list;
}

Json file_set(const FileGroup& group) {
  const std::string ending = group.extension.empty() ? "" : "." + core::printable(group.extension);
  return Json::object()
      .set("@type", "cr:FileSet")
      .set("@id", fmt::format("{}-files{}", group.format, ending))
      .set("name", fmt::format("{}-files{}", group.format, ending))
      .set("description",
           fmt::format("{} files{} in {} format.", group.num_files,
                       ending.empty() ? "" : " *" + ending, reading_of(group.format).title))
      .set("encodingFormat", mime_type(group.extension))
      .set("includes", fmt::format("{}/**/*{}", group.format, ending));
}

Json field(std::string_view record_set, std::string_view name, std::string_view meaning,
           std::string_view type) {
  const std::string id = fmt::format("{}/{}", record_set, name);
  return Json::object()
      .set("@type", "cr:Field")
      .set("@id", id)
      .set("name", name)
      .set("description", meaning)
      .set("dataType", type);
}

Json split_records() {
  static constexpr std::array<const char*, 3> kMeanings = {"cr:TrainingSplit", "cr:ValidationSplit",
                                                           "cr:TestSplit"};
  Json data = Json::array();
  for (std::size_t k = 0; k < kSplitNames.size(); ++k)
    data.push(Json::object().set("splits/name", kSplitNames[k]).set("splits/url", kMeanings[k]));
  return Json::object()
      .set("@type", "cr:RecordSet")
      .set("@id", "splits")
      .set("name", "splits")
      .set("description", "The splits; no ground is seen in two of them.")
      .set("dataType", "cr:Split")
      .set("key", reference("splits/name"))
      .set("field", Json::array()
                        .push(field("splits", "name", "Name of the split.", "sc:Text"))
                        .push(field("splits", "url", "What it is for.", "sc:URL")))
      .set("data", data);
}

Json sequence_records() {
  Json fields = Json::array();
  for (const IndexField& column : index_fields()) {
    Json entry = field("sequences", column.name, column.meaning, column.type);
    if (column.is_repeated) entry.set("repeated", true);
    entry.set("source", Json::object()
                            .set("fileObject", reference(kIndexFile))
                            .set("extract", Json::object().set("column", column.name)));
    if (column.name == "split") entry.set("references", reference("splits/name"));
    fields.push(entry);
  }
  return Json::object()
      .set("@type", "cr:RecordSet")
      .set("@id", "sequences")
      .set("name", "sequences")
      .set("description", "One record a sequence.")
      .set("key", reference("sequences/id"))
      .set("field", fields);
}

}  // namespace

Json croissant(const DatasetFacts& facts) {
  const Publication& publication = facts.publication;
  Json json = Json::object()
                  .set("@context", context())
                  .set("@type", "sc:Dataset")
                  .set("name", core::printable(publication.name))
                  .set("conformsTo", "http://mlcommons.org/croissant/1.0")
                  .set("description", description(facts));
  if (const Json list = licences(facts); list.size() == 1)
    json.set("license", list.at(std::size_t{0}));
  else if (list.size() > 1)
    json.set("license", list);
  if (!publication.url.empty()) json.set("url", core::printable(publication.url));
  if (!publication.creators.empty()) {
    Json creators = Json::array();
    for (const std::string& name : publication.creators)
      creators.push(
          Json::object().set("@type", "sc:Organization").set("name", core::printable(name)));
    json.set("creator", creators);
  }
  if (!publication.date_published.empty())
    json.set("datePublished", core::printable(publication.date_published));
  if (!publication.cite_as.empty()) json.set("citeAs", printable_lines(publication.cite_as));
  json.set("version", core::printable(publication.version)).set("isLiveDataset", false);
  std::set<std::string> formats;
  for (const FileGroup& group : group_files(facts)) formats.insert(group.format);
  Json keywords = Json::array();
  for (const char* keyword : {"aerial", "camera poses", "depth", "geospatial", "synthetic"})
    keywords.push(keyword);
  json.set("keywords", keywords);
  Json distribution = file_objects(facts, formats);
  for (const FileGroup& group : group_files(facts)) distribution.push(file_set(group));
  return json.set("distribution", distribution)
      .set("recordSet", Json::array().push(split_records()).push(sequence_records()));
}

std::vector<std::string> croissant_gaps(const DatasetFacts& facts) {
  const Publication& publication = facts.publication;
  std::vector<std::string> gaps;
  if (publication.url.empty()) gaps.emplace_back("url");
  if (publication.creators.empty()) gaps.emplace_back("creator");
  if (publication.date_published.empty()) gaps.emplace_back("datePublished");
  if (licences(facts).size() == 0) gaps.emplace_back("license");
  return gaps;
}

}  // namespace terracast::batch
