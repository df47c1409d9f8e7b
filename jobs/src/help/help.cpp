#include "help/help.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <string_view>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

/// What fits a screen beside usage and examples.
constexpr std::size_t few_options = 12;
constexpr std::array<std::string_view, 20> most_used{
    "turntable", "sweep-section", "views",   "section", "sheet", "output",    "boundary",
    "picture",   "snapshot",      "threads", "curved",  "open",  "tolerance", "budget",
    "partial",   "port",          "quiet",   "stay",    "size",  "group"};

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options(
      [](const CLI::Option* option) { return option->nonpositional() && !option->get_group().empty(); });
}

std::vector<const CLI::Option*> arguments_of(const CLI::App& app) {
  return app.get_options(
      [](const CLI::Option* option) { return option->get_positional() && !option->get_group().empty(); });
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* each) { return !each->get_group().empty(); });
}

bool is_most_used(const CLI::Option& option) {
  return std::any_of(most_used.begin(), most_used.end(),
                     [&](std::string_view name) { return option.check_lname(std::string(name)); });
}

/// The first line of a text, without what joins it to the next.
std::string first_line(const std::string& text) {
  std::string line = text.substr(0, text.find('\n'));
  while (line.ends_with(',') || line.ends_with(':') || line.ends_with(';')) line.pop_back();
  return line;
}

/// In lines of so many letters: as it is if its own lines are short enough, else word by word.
std::string in_lines(const std::string& text, std::size_t width) {
  std::istringstream lines(text), words(text);
  bool fits = true;
  for (std::string line; std::getline(lines, line);) fits = fits && line.size() <= width;
  if (fits) return text;
  std::string result;
  std::size_t column = 0;
  for (std::string word; words >> word; column += word.size()) {
    const bool is_new_line = column > 0 && column + 1 + word.size() > width;
    if (column > 0) result += is_new_line ? '\n' : ' ';
    column = is_new_line ? 0 : column + (column > 0 ? 1 : 0);
    result += word;
  }
  return result;
}

std::string in_one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// "N" of "N:1 .. 4096".
std::string type_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  return type.substr(0, type.find(':'));
}

/// Those between the braces of "WHERE:{master,tree,file}".
std::vector<std::string> values_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto begin = type.find('{'), end = type.find('}');
  if (begin == std::string::npos || end == std::string::npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

bool takes_value(const CLI::Option& option) {
  return option.get_items_expected_max() > 0 && !type_of(option).empty();
}

bool takes_file(const CLI::Option& option) {
  const std::string type = type_of(option);
  return type.starts_with("FILE") || type == "DIR" || type == "PREFIX" ||
         (option.get_positional() && type.empty());
}

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    if (mode == CLI::AppFormatMode::Sub || !is_short(app, mode))
      return CLI::detail::find_and_replace(CLI::Formatter::make_help(app, name, mode), "\n\n\n", "\n\n");
    std::string footer = app->get_footer();
    footer = footer.substr(0, footer.find("\n\n"));
    const std::string full = name + " --help-all";
    return make_description(app) + make_usage(app, name) + make_positionals(app) + "\n" +
           short_options(*app) + "\n" + footer + "\nAll " +
           counted(options_of(*app).size(), "# option[s], by topic: ") + full + "\n";
  }

  /// No ranges in short help, and none of the marks that only matter to CLI11.
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string value = takes_value(*option) ? " " + type_of(*option) : "";
    return value + (option->get_required() ? " " + get_label("REQUIRED") : "");
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    const std::string range = range_of(*option);
    return in_lines(option->get_description(), text_width()) + (range.empty() ? "" : "\n(" + range + ")");
  }

 private:
  /// Of what stands beside an option's name, for 80 columns; commands within others stand two to the right.
  [[nodiscard]] std::size_t text_width() const { return 80 - 2 - get_column_width(); }

  static bool is_short(const CLI::App* app, CLI::AppFormatMode mode) {
    return mode == CLI::AppFormatMode::Normal && options_of(*app).size() > few_options;
  }

  /// "1 .. 4096, by default 3" of a number.
  static std::string range_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const auto colon = type.find(':');
    std::string range;
    if (colon != std::string::npos && type.find('{') == std::string::npos) range = type.substr(colon + 1);
    if (const std::string value = option.get_default_str(); !value.empty())
      range += (range.empty() ? "" : ", ") + ("by default " + value);
    return range;
  }

  std::string short_options(const CLI::App& app) const {
    std::ostringstream out;
    out << "Options, those most used:\n";
    for (const CLI::Option* option : options_of(app))
      if (is_most_used(*option))
        CLI::detail::format_help(out, option->get_name(false, true) + make_option_opts(option),
                                 first_line(in_lines(option->get_description(), text_width())),
                                 get_column_width());
    return out.str();
  }
};

/// What troff would take for a command of its own is kept from it.
std::string troff(const std::string& text) {
  std::string safe;
  bool at_start = true;
  for (const char each : text) {
    if (at_start && (each == '.' || each == '\'')) safe += "\\&";
    if (each == '\\')
      safe += "\\e";
    else if (each == '-')
      safe += "\\-";
    else
      safe += each;
    at_start = each == '\n';
  }
  return safe;
}

void write_option(std::ostream& out, const CLI::Option& option) {
  const std::string type = takes_value(option) ? type_of(option) : "";
  out << ".TP\n\\fB" << troff(option.get_name(option.get_positional(), true)) << "\\fR";
  if (!type.empty()) out << " \\fI" << troff(type) << "\\fR";
  out << '\n' << troff(in_one_line(option.get_description())) << '\n';
}

void write_command(std::ostream& out, const CLI::App& command, const std::string& path) {
  const std::string name = path + " " + command.get_name();
  if (const auto inner = commands_of(command); !inner.empty()) {
    for (const CLI::App* each : inner) write_command(out, *each, name);
    return;
  }
  out << ".SS " << troff(name);
  for (const CLI::Option* argument : arguments_of(command)) out << ' ' << troff(argument->get_name(true));
  out << '\n' << troff(command.get_description()) << ".\n";
  for (const CLI::Option* argument : arguments_of(command)) write_option(out, *argument);
  for (const std::string& group : command.get_groups())
    for (const CLI::Option* option : options_of(command))
      if (option->get_group() == group && !option->check_lname("help") && !option->check_lname("help-all"))
        write_option(out, *option);
  if (const std::string& footer = command.get_footer(); !footer.empty())
    out << ".PP\n.nf\n" << troff(footer) << "\n.fi\n";
}

/// The command that was typed so far, and the last word before the one to be completed.
const CLI::App* typed_command(const CLI::App& app, std::span<const std::string> words) {
  const CLI::App* command = &app;
  for (const std::string& word : words)
    for (const CLI::App* each : commands_of(*command))
      if (each->get_name() == word) {
        command = each;
        break;
      }
  return command;
}

const CLI::Option* option_named(const CLI::App& command, const std::string& word) {
  for (const CLI::Option* option : options_of(command))
    if (word.starts_with('-') && option->check_name(word)) return option;
  return nullptr;
}

void add_if_fits(Completions& found, const std::string& word, const std::string& begun,
                 const std::string& description) {
  if (word.starts_with(begun)) found.words.push_back({word, first_line(description)});
}

}  // namespace

std::shared_ptr<CLI::Formatter> make_help_formatter() { return std::make_shared<HelpFormatter>(); }

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* each : commands_of(app)) names.push_back(each->get_name());
  return names;
}

Completions completions_of(const CLI::App& app, std::span<const std::string> words) {
  Completions found;
  if (words.empty()) return found;
  std::string begun = words.back();
  words = words.first(words.size() - 1);
  if (begun == "=")
    begun.clear();  // bash parts words there
  else if (!words.empty() && words.back() == "=")
    words = words.first(words.size() - 1);
  const CLI::App* command = typed_command(app, words);
  if (const CLI::Option* option = words.empty() ? nullptr : option_named(*command, words.back());
      option && takes_value(*option)) {
    for (const std::string& value : values_of(*option)) add_if_fits(found, value, begun, "");
    found.files = takes_file(*option);
    return found;
  }
  if (begun.starts_with('-')) {
    for (const CLI::Option* option : options_of(*command))
      for (const std::string& name : option->get_lnames())
        add_if_fits(found, "--" + name, begun, option->get_description());
    return found;
  }
  for (const CLI::App* each : commands_of(*command))
    add_if_fits(found, each->get_name(), begun, each->get_description());
  for (const CLI::Option* argument : arguments_of(*command)) {
    for (const std::string& value : values_of(*argument)) add_if_fits(found, value, begun, "");
    found.files = found.files || takes_file(*argument);
  }
  return found;
}

std::string completion_lines(const CLI::App& app, std::span<const std::string> words) {
  const Completions found = completions_of(app, words);
  std::string lines;
  for (const Completion& each : found.words) lines += each.word + "\t" + each.description + "\n";
  if (found.files) lines += ":files\n";
  return lines;
}

std::string completion_script(const std::string& shell) {
  static const std::map<std::string, std::string> scripts{
      {"bash",
       R"sh(# Completion for bsp2: source it, or put it into ~/.local/share/bash-completion/completions/bsp2
_bsp2() {
  local line
  COMPREPLY=()
  while IFS= read -r line; do
    if [[ $line == :files ]]; then compopt -o default; else COMPREPLY+=("${line%%$'\t'*}"); fi
  done < <("${COMP_WORDS[0]}" __complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -F _bsp2 bsp2
)sh"},
      {"zsh", R"sh(#compdef bsp2
# Completion for bsp2: put it as _bsp2 into a folder of $fpath
_bsp2() {
  local line files=0
  local -a found
  for line in ${(f)"$("${words[1]}" __complete "${(@)words[2,CURRENT]}" 2>/dev/null)"}; do
    if [[ $line == :files ]]; then files=1; else found+=("${line%%$'\t'*}:${line#*$'\t'}"); fi
  done
  (( ${#found} )) && _describe 'bsp2' found
  (( files )) && _files
}
if [[ $funcstack[1] == _bsp2 ]]; then _bsp2 "$@"; else compdef _bsp2 bsp2; fi
)sh"},
      {"fish", R"sh(# Completion for bsp2: put it into ~/.config/fish/completions/bsp2.fish
function __bsp2_complete
  set -l words (commandline -opc) (commandline -ct)
  for line in ($words[1] __complete $words[2..-1] 2>/dev/null)
    if test $line = :files
      __fish_complete_path (commandline -ct)
    else
      echo $line
    end
  end
end
complete -c bsp2 -f -a '(__bsp2_complete)'
)sh"}};
  return scripts.at(shell);
}

std::string manual_page(const CLI::App& app) {
  std::ostringstream out;
  out << ".TH BSP2 1 \"\" \"bsp2 " BSP2_VERSION "\" \"User Commands\"\n"
      << ".SH NAME\nbsp2 \\- evaluate a solid model into an exact mesh of convex cells, in parallel\n.SH "
         "SYNOPSIS\n";
  for (const CLI::App* command : commands_of(app))
    out << ".B bsp2 " << troff(command->get_name()) << "\n...\n.br\n";
  out << ".SH DESCRIPTION\n" << troff(app.get_description()) << "\n.SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) write_command(out, *command, "bsp2");
  out << ".SH EXIT STATUS\n.TP\n0\nsuccess\n.TP\n1\nan error of bsp2 itself\n.TP\n2\na mistake in the "
         "options, the model or a path\n"
      << ".TP\n75\nended early by SIGINT, SIGTERM or SIGUSR1; the snapshot holds what there is\n";
  return out.str();
}

}  // namespace bsp2::jobs
