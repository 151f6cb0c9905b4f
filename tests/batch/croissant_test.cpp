#include "batch/dataset/croissant.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <set>

#include "batch/dataset/index.h"
#include "tests/batch/sample_facts.h"

namespace terracast::batch {
namespace {

using core::Json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Holds a description against Croissant 1.0 (http://mlcommons.org/croissant/1.0), as its text was
/// read when this was written: properties that it requires, of which types, and what its references
/// must lead to.
class Specification {
 public:
  static std::vector<std::string> faults(const Json& json) {
    Specification specification;
    specification.check(json);
    return specification.faults_;
  }

 private:
  void require(bool holds, const std::string& what) {
    if (!holds) faults_.push_back(what);
  }
  static bool is_text(const Json& json, const char* member) {
    try {
      return json.has(member) && !json.at(member).string().empty();
    } catch (const core::Error&) {
      return false;
    }
  }
  static std::string text(const Json& json, const char* member) {
    return is_text(json, member) ? json.at(member).string() : "";
  }
  static bool is_url(const std::string& text) {
    return text.starts_with("https://") || text.starts_with("http://");
  }
  /// A value, or a list of them.
  static std::vector<Json> many(const Json& json, const char* member) {
    std::vector<Json> values;
    if (!json.has(member)) return values;
    const Json& value = json.at(member);
    if (!value.is_array()) return {value};
    for (std::size_t i = 0; i < value.size(); ++i) values.push_back(value.at(i));
    return values;
  }

  void check(const Json& json) {
    check_terms(json);
    // Required of a dataset.
    require(text(json, "@type") == "sc:Dataset", "@type must be schema.org's Dataset");
    require(text(json, "conformsTo") == "http://mlcommons.org/croissant/1.0", "conformsTo");
    for (const char* member : {"name", "description"}) require(is_text(json, member), member);
    require(is_url(text(json, "url")), "url must be one");
    require(std::regex_match(text(json, "datePublished"), std::regex(R"(\d{4}-\d\d-\d\d)")),
            "datePublished must be a day");
    const std::vector<Json> licences = many(json, "license");
    require(!licences.empty(), "license");
    for (const Json& licence : licences)
      require(licence.is_object() ? text(licence, "@type") == "sc:CreativeWork"
                                  : is_url(licence.string()),
              "license must be a CreativeWork or a URL");
    const std::vector<Json> creators = many(json, "creator");
    require(!creators.empty(), "creator");
    for (const Json& creator : creators)
      require(creator.is_object() && is_text(creator, "name") &&
                  (text(creator, "@type") == "sc:Organization" ||
                   text(creator, "@type") == "sc:Person"),
              "creator must be an Organization or a Person");
    require(std::regex_match(text(json, "version"), std::regex(R"(\d+\.\d+\.\d+)")),
            "version must be MAJOR.MINOR.PATCH");
    const std::vector<Json> distribution = many(json, "distribution");
    require(!distribution.empty(), "distribution");
    for (const Json& resource : distribution) check_resource(resource);
    for (const Json& records : many(json, "recordSet")) name_records(records);
    for (const Json& records : many(json, "recordSet")) check_records(records);
  }

  /// A short name that the context leaves to schema.org must be a property there; all others are
  /// Croissant's.
  void check_terms(const Json& json) {
    const Json& context = json.at("@context");
    require(text(context, "@vocab") == "https://schema.org/", "@vocab");
    require(text(context, "sc") == "https://schema.org/", "prefix sc");
    require(text(context, "cr") == "http://mlcommons.org/croissant/", "prefix cr");
    require(text(context, "dct") == "http://purl.org/dc/terms/", "prefix dct");
    require(text(context, "conformsTo") == "dct:conformsTo", "conformsTo is a term of Dublin Core");
    static const std::set<std::string> of_schema_org = {
        "name",          "description",    "license",  "url",          "creator",
        "datePublished", "version",        "keywords", "distribution", "contentUrl",
        "contentSize",   "encodingFormat", "sha256",   "publisher"};
    walk(json, [&](const std::string& name) {
      if (name.starts_with("@") || name == "conformsTo" || of_schema_org.contains(name)) return;
      if (!context.has(name))
        return require(false, "the context does not say what " + name + " is");
      const Json& term = context.at(name);
      require((term.is_object() ? text(term, "@id") : term.string()) == "cr:" + name,
              name + " is Croissant's");
    });
  }
  template <class Visit>
  static void walk(const Json& json, const Visit& visit) {
    if (json.is_array())
      for (std::size_t i = 0; i < json.size(); ++i) walk(json.at(i), visit);
    if (!json.is_object()) return;
    for (const auto& [name, value] : json.members()) {
      visit(name);
      if (name != "@context" && name != "data") walk(value, visit);
    }
  }

  void name(const Json& node) {
    require(is_text(node, "@id"), "an @id is missing");
    require(ids_.insert(text(node, "@id")).second, "@id " + text(node, "@id") + " is there twice");
  }

  void check_resource(const Json& resource) {
    name(resource);
    const std::string id = text(resource, "@id");
    require(is_text(resource, "name"), id + ": name");
    require(std::regex_match(text(resource, "encodingFormat"), std::regex("[a-z]+/[a-z0-9.+-]+")),
            id + ": encodingFormat must be a MIME type");
    if (text(resource, "@type") == "cr:FileObject") {
      files_.insert(id);
      require(is_text(resource, "contentUrl"), id + ": contentUrl");
      require(std::regex_match(text(resource, "sha256"), std::regex("[0-9a-f]{64}")),
              id + ": sha256");
      require(std::regex_match(text(resource, "contentSize"), std::regex(R"(\d+ B)")),
              id + ": contentSize");
    } else {
      require(text(resource, "@type") == "cr:FileSet", id + ": neither FileObject nor FileSet");
      require(!many(resource, "includes").empty(), id + ": includes");
    }
  }

  void name_records(const Json& records) {
    name(records);
    require(text(records, "@type") == "cr:RecordSet", text(records, "@id") + ": @type");
    for (const Json& field : many(records, "field")) {
      name(field);
      fields_.insert(text(field, "@id"));
      require(text(field, "@id").starts_with(text(records, "@id") + "/"),
              text(field, "@id") + " must begin with its record set's @id");
    }
  }

  void check_records(const Json& records) {
    static const std::set<std::string> atomic = {"sc:Boolean", "sc:Date", "sc:Float",
                                                 "sc:Integer", "sc:Text", "sc:URL"};
    const std::string id = text(records, "@id");
    for (const Json& key : many(records, "key"))
      require(fields_.contains(text(key, "@id")), id + ": its key is no field");
    const std::vector<Json> fields = many(records, "field");
    require(!fields.empty(), id + ": no field");
    for (const Json& field : fields) {
      const std::string field_id = text(field, "@id");
      require(text(field, "@type") == "cr:Field", field_id + ": @type");
      require(atomic.contains(text(field, "dataType")), field_id + ": dataType");
      if (records.has("data")) continue;
      require(field.has("source") && field.at("source").has("fileObject") &&
                  files_.contains(text(field.at("source").at("fileObject"), "@id")),
              field_id + ": its source is no file");
      require(field.has("source") && field.at("source").has("extract") &&
                  is_text(field.at("source").at("extract"), "column"),
              field_id + ": nothing is extracted");
      if (field.has("references"))
        require(fields_.contains(text(field.at("references"), "@id")),
                field_id + ": references what is not there");
    }
    for (const Json& record : many(records, "data"))
      for (const auto& [member, value] : record.members())
        require(fields_.contains(member), id + ": data of " + member + ", which is no field");
  }

  std::set<std::string> ids_;
  std::set<std::string> files_;
  std::set<std::string> fields_;
  std::vector<std::string> faults_;
};

TEST(Croissant, HoldsAgainstTheSpecification) {
  EXPECT_THAT(Specification::faults(croissant(sample_facts())), IsEmpty());
  EXPECT_THAT(croissant_gaps(sample_facts()), IsEmpty());
}

TEST(Croissant, LacksWhatNobodyHasStatedAndSaysSo) {
  DatasetFacts facts = sample_facts();
  facts.publication.url = facts.publication.date_published = "";
  facts.publication.creators = {};
  const Json json = croissant(facts);
  for (const char* member : {"url", "datePublished", "creator"}) EXPECT_FALSE(json.has(member));
  EXPECT_THAT(Specification::faults(json),
              ElementsAre("url must be one", "datePublished must be a day", "creator"));
  EXPECT_THAT(croissant_gaps(facts), ElementsAre("url", "creator", "datePublished"));
}

TEST(Croissant, TakesTheSourcesLicencesWhereTheDatasetHasNone) {
  DatasetFacts facts = sample_facts();
  facts.publication.licence = "";
  const Json licences = croissant(facts).at("license");
  ASSERT_EQ(licences.size(), 3U);
  EXPECT_EQ(licences.at(std::size_t{0}).string(), "https://spdx.org/licenses/ODbL-1.0.html");
  EXPECT_EQ(licences.at(1).at("name").string(), "SRTM, NASA/USGS; public domain");
  EXPECT_THAT(Specification::faults(croissant(facts)), IsEmpty());
  facts.publication.licence = "Our own terms";
  EXPECT_EQ(croissant(facts).at("license").at("name").string(), "Our own terms");
  facts.publication.licence_url = "https://example.org/terms";
  EXPECT_EQ(croissant(facts).at("license").string(), "https://example.org/terms");
  facts.publication.licence = facts.publication.licence_url = "";
  facts.places.clear();
  EXPECT_FALSE(croissant(facts).has("license"));
  EXPECT_THAT(croissant_gaps(facts), ElementsAre("license"));
}

/// Whether a path is among a pattern's, where ** stands for any folders and * for part of a name.
bool is_included(const std::string& path, const std::string& pattern) {
  std::string regex;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern.compare(i, 3, "**/") == 0) {
      regex += "(.*/)?";
      i += 2;
    } else if (pattern[i] == '*') {
      regex += "[^/]*";
    } else if (std::string_view(".+()[]{}^$|?\\").find(pattern[i]) != std::string_view::npos) {
      regex += std::string("\\") + pattern[i];
    } else {
      regex += pattern[i];
    }
  }
  return std::regex_match(path, std::regex(regex));
}

TEST(Croissant, DescribesEachFileOnce) {
  const DatasetFacts facts = sample_facts();
  const Json distribution = croissant(facts).at("distribution");
  for (const FileFacts& file : facts.files) {
    int count = 0;
    for (std::size_t i = 0; i < distribution.size(); ++i) {
      const Json& resource = distribution.at(i);
      if (resource.has("includes")) {
        count += is_included(file.path, resource.at("includes").string()) ? 1 : 0;
      } else if (resource.at("contentUrl").string() == file.path) {
        ++count;
        EXPECT_EQ(resource.at("sha256").string(), file.sha256);
        EXPECT_EQ(resource.at("contentSize").string(), fmt::format("{} B", file.num_bytes));
      }
    }
    EXPECT_EQ(count, 1) << file.path;
  }
}

TEST(Croissant, HasAFieldForEachMemberOfTheIndexOfItsType) {
  const DatasetFacts facts = sample_facts();
  const std::string text = index_lines(facts.sequences);
  const Json line = Json::parse(text.substr(0, text.find('\n')), "index.jsonl");
  const Json records = croissant(facts).at("recordSet").at(1);
  ASSERT_EQ(records.at("@id").string(), "sequences");
  std::vector<std::string> columns;
  for (std::size_t i = 0; i < records.at("field").size(); ++i) {
    const Json& field = records.at("field").at(i);
    const std::string column = field.at("source").at("extract").at("column").string();
    columns.push_back(column);
    const Json& value = line.at(column);
    const std::string type = field.at("dataType").string();
    EXPECT_EQ(value.is_array(), field.has("repeated")) << column;
    if (value.is_array())
      EXPECT_NO_THROW(value.strings()) << column;
    else if (type == "sc:Text")
      EXPECT_NO_THROW(value.string()) << column;
    else if (type == "sc:Integer")
      EXPECT_NO_THROW(value.integer()) << column;
    else
      EXPECT_NO_THROW(value.number()) << column;
  }
  std::vector<std::string> members;
  for (const auto& [name, value] : line.members()) members.push_back(name);
  EXPECT_EQ(columns, members);
}

TEST(Croissant, NamesTheSplitsByWhatTheyAreFor) {
  const Json splits = croissant(sample_facts()).at("recordSet").at(std::size_t{0});
  EXPECT_EQ(splits.at("dataType").string(), "cr:Split");
  EXPECT_EQ(splits.at("data").at(std::size_t{0}).at("splits/name").string(), "train");
  EXPECT_EQ(splits.at("data").at(std::size_t{0}).at("splits/url").string(), "cr:TrainingSplit");
  EXPECT_EQ(splits.at("data").at(1).at("splits/url").string(), "cr:ValidationSplit");
  EXPECT_EQ(splits.at("data").at(2).at("splits/url").string(), "cr:TestSplit");
}

TEST(Croissant, DoesNotDependOnTheOrderOfItsFacts) {
  const DatasetFacts facts = sample_facts();
  DatasetFacts turned = facts;
  std::reverse(turned.sequences.begin(), turned.sequences.end());
  std::reverse(turned.places.begin(), turned.places.end());
  std::reverse(turned.files.begin(), turned.files.end());
  EXPECT_EQ(croissant(turned).text(), croissant(facts).text());
}

TEST(Croissant, TakesHostileTextAsText) {
  DatasetFacts facts = sample_facts();
  facts.publication.name = facts.publication.description = facts.publication.cite_as =
      "no\xffutf8 \"quoted\"\n\x01";
  facts.files.push_back({"plots/of a#1:2?.png", 10, facts.files[0].sha256});
  const Json json = Json::parse(croissant(facts).text(), "croissant.json");
  EXPECT_EQ(json.at("name").string(), "no\\xffutf8 \"quoted\"\\x0a\\x01");
  EXPECT_EQ(json.at("description").string(), "no\\xffutf8 \"quoted\"\n\\x01");
  EXPECT_THAT(json.text(), HasSubstr("plots/of%20a%231%3A2%3F.png"));
  EXPECT_THAT(Specification::faults(json), IsEmpty());
}

TEST(Croissant, FaultsWouldBeFound) {
  // The check itself: each change makes one fault.
  const auto faults_of = [](const std::string& from, const std::string& to) {
    std::string text = croissant(sample_facts()).text();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return Specification::faults(Json::parse(text, "changed")).size();
  };
  EXPECT_EQ(faults_of("croissant/1.0", "croissant/0.8"), 1U);
  EXPECT_EQ(faults_of("\"sc:Dataset\"", "\"sc:Thing\""), 1U);
  EXPECT_EQ(faults_of("\"1.2.0\"", "\"1.2\""), 1U);
  EXPECT_EQ(faults_of("\"image/png\"", "\"picture\""), 1U);
  EXPECT_EQ(faults_of("\"field\": \"cr:field\"", "\"field\": \"ml:field\""),
            2U);  // of two record sets
  EXPECT_EQ(faults_of("\"@id\": \"splits/name\"\n", "\"@id\": \"splits/nme\"\n"), 1U);
  EXPECT_EQ(faults_of("\"@id\": \"sequences/run\"", "\"@id\": \"sequences/sequence\""), 1U);
  EXPECT_EQ(faults_of("\"@type\": \"cr:Field\"", "\"@type\": \"cr:Fld\""), 1U);
}

}  // namespace
}  // namespace terracast::batch
