// What messages say of numbers of things is grammatical: every sentence of `counted` in the sources is
// printed with 0, 1 and 2, and no source makes singular and plural by itself.

#include "bsp2/geometry/support/counted.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace bsp2 {
namespace {

namespace fs = std::filesystem;
using std::string;

TEST(Counted, SaysOneAndMany) {
  EXPECT_EQ(grouped(-123), "-123");
  EXPECT_EQ(grouped(-1234567LL), "-1,234,567");
  EXPECT_EQ(counted(-1, "# edge[s]"), "-1 edges");
  EXPECT_EQ(counted(0, "# edge[s] [is|are] open"), "0 edges are open");
  EXPECT_EQ(counted(1, "# edge[s] [is|are] open"), "1 edge is open");
  EXPECT_EQ(counted(2, "# edge[s] [is|are] open"), "2 edges are open");
  EXPECT_EQ(counted(1'000'001, "of [it|them #]"), "of them #");
  EXPECT_EQ(counted(12'345, "# of #"), "12,345 of 12,345");
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1'000), "1,000");
  EXPECT_EQ(grouped(~std::uint64_t{0}), "18,446,744,073,709,551,615");
}

struct Source {
  fs::path path;
  string text;
};

/// All sources of the rooms; bsplib depends on none of them.
const std::vector<Source>& sources() {
  static const std::vector<Source> all = [] {
    std::vector<Source> found;
    for (const char* room :
         {"api", "dataflow", "drawing", "geometry", "io", "jobs", "meshing", "model", "supersteps"})
      for (const auto& entry : fs::recursive_directory_iterator(fs::path(BSP2_SOURCE_DIR) / room)) {
        const fs::path& path = entry.path();
        if (path.extension() != ".cpp" && path.extension() != ".hpp") continue;
        if (path.stem() == "counted") continue;
        std::ifstream file(path);
        found.push_back({path, string(std::istreambuf_iterator<char>(file), {})});
      }
    return found;
  }();
  return all;
}

/// The literal, or several one behind the other, that begins there. @return nothing if there is none.
string literal_at(const string& text, std::size_t at) {
  string value;
  while ((at = text.find_first_not_of(" \n", at)) != string::npos && text[at] == '"')
    for (++at; text[at] != '"' || (++at, false); ++at) value += text[at] == '\\' ? text[++at] : text[at];
  return value;
}

/// Where the first argument ends that begins there.
std::size_t behind_argument(const string& text, std::size_t at) {
  for (int depth = 0; at < text.size() && (depth > 0 || text[at] != ','); ++at)
    depth += (text[at] == '(' || text[at] == '{' || text[at] == '[') -
             (text[at] == ')' || text[at] == '}' || text[at] == ']');
  return at + 1;
}

struct Sentence {
  string place, text;
};

/// What `counted` is called with, everywhere.
std::vector<Sentence> sentences() {
  std::vector<Sentence> all;
  const string call = "counted(";
  for (const auto& [path, text] : sources())
    for (std::size_t at = text.find(call); at != string::npos; at = text.find(call, at + 1)) {
      if (at > 0 && (std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0 || text[at - 1] == '_'))
        continue;
      all.push_back({path.string() + ":" +
                         std::to_string(1 + std::count(text.begin(),
                                                       text.begin() + static_cast<std::ptrdiff_t>(at), '\n')),
                     literal_at(text, behind_argument(text, at + call.size()))});
    }
  return all;
}

/// Whether one word is of one thing what the other is of many: a noun, which has an s more for many; a verb,
/// which has one less; or one that is told here.
bool agree(const string& one, const string& many) {
  static const std::set<std::pair<string, string>> others{{"is", "are"},
                                                          {"was", "were"},
                                                          {"has", "have"},
                                                          {"it", "they"},
                                                          {"it", "them"},
                                                          {"it", "these"},
                                                          {"its", "their"},
                                                          {"or", "and"},
                                                          {"another", "others"},
                                                          {"vertex", "vertices"},
                                                          {"entry", "entries"},
                                                          {"tetrahedron", "tetrahedra"},
                                                          {"polyhedron", "polyhedra"}};
  return one == many || many == one + "s" || many == one + "es" || one == many + "s" || one == many + "es" ||
         others.contains({one, many});
}

/// Both forms of each choice in the sentence, with the letters beside it.
std::vector<std::pair<string, string>> forms_of(const string& sentence) {
  static const std::regex choice(R"(([a-z]*)\[(([^\]|]*)\|)?([^\]|]*)\]([a-z]*))");
  std::vector<std::pair<string, string>> forms;
  for (std::sregex_iterator at(sentence.begin(), sentence.end(), choice), end; at != end; ++at) {
    const std::smatch& m = *at;
    forms.emplace_back(m.str(1) + m.str(3) + m.str(5), m.str(1) + m.str(4) + m.str(5));
  }
  return forms;
}

/// Without those that have one form, and stand on one side alone.
std::vector<string> changing_words(const string& text) {
  static const std::set<string> others{"a", "an", "all", "as", "each", "of", "one", "the"};
  static const std::regex word("[A-Za-z']+");
  std::vector<string> words;
  for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at)
    if (!others.contains(at->str())) words.push_back(at->str());
  return words;
}

TEST(Counted, IsRightInEverySentenceOfTheSources) {
  // A word that changes with the number has both forms where it follows a noun that has.
  const std::regex in_one_number(
      R"(# ([a-z]+ )*[a-z]*\[[^|\]]*(\|[^\]]*)?\] (is|are|was|were|has|have|it|they)\b)");
  const std::vector<Sentence> all = sentences();
  EXPECT_GT(all.size(), 100U);
  for (const auto& [place, text] : all) {
    SCOPED_TRACE(place + ": " + text);
    EXPECT_NE(text, "") << "the sentence has to stand in the call";
    EXPECT_NE(text.find_first_of("#["), string::npos) << "nothing in it depends on the number";
    EXPECT_FALSE(std::regex_search(text, in_one_number));
    const string none = counted(0, text), one = counted(1, text), two = counted(2, text);
    for (const string& said : {none, one, two}) {
      EXPECT_EQ(said.find_first_of("#[]|"), string::npos) << said;
      EXPECT_EQ(said.find("  "), string::npos) << said;
    }
    for (const auto& [of_one, of_many] : forms_of(text)) {
      EXPECT_NE(one.find(of_one), string::npos);
      EXPECT_NE(none.find(of_many), string::npos);
      EXPECT_NE(two.find(of_many), string::npos);
      const auto a = changing_words(of_one), b = changing_words(of_many);
      EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end(), agree)) << of_one << " | " << of_many;
    }
  }
}

TEST(Counted, IsWhatMessagesAreMadeWith) {
  // Limits are no numbers of one thing. What std::regex repeats without bounds takes a frame of the stack
  // each.
  const std::regex by_hand(
      R"([=!]= 1U? \?\s*(std::string\()?"[^"]|"s"\s*[:)]|[a-z]{3,}\(s\) [a-z]|)"
      R"(to_string\((?!(\w+::)*(most|max|largest|deepest|built|format)_)[^;"]{0,160}\) \+\s*" (more )?)"
      R"((?!(is|has|was|names|comes|takes|does)\b)[a-z]+s\b|)"
      R"("[^"]{0,160}\{\} (more )?(?!(is|has|was|degrees)\b)[a-z]+s\b)");
  for (const auto& [path, text] : sources())
    for (std::sregex_iterator at(text.begin(), text.end(), by_hand), end; at != end; ++at)
      ADD_FAILURE() << path << ": " << at->str() << ": bsp2::counted has singular and plural";
}

}  // namespace
}  // namespace bsp2
