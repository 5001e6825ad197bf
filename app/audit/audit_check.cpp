#include "app/audit/audit_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/output_file.h"
#include "core/error.h"
#include "core/text.h"

namespace knuckle::audit {

namespace {

class Checker {
 public:
  explicit Checker(const std::string& folder) : folder_(folder), head_(read_head(folder)) {}

  Check run() {
    const std::vector<std::uint64_t> numbers = file_numbers(folder_);
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (i > 0 && numbers[i] != numbers[i - 1] + 1) {
        broken(file_of(folder_, numbers[i - 1] + 1), 0, "is missing");
        before_.reset();
      }
      ++check_.files;
      check_file(numbers[i], i + 1 == numbers.size());
    }
    check_end();
    if (!numbers.empty()) check_begin(numbers.front());
    return std::move(check_);
  }

 private:
  void broken(const std::string& file, std::size_t line, const std::string& why) {
    if (file == broken_file_) return;
    broken_file_ = file;
    check_.breaks.push_back(line == 0 ? file + ": " + why : fmt::format("{}:{}: {}", file, line, why));
  }

  void check_file(std::uint64_t number, bool newest) {
    const std::string file = file_of(folder_, number);
    const FileContent content = read_lines(file);
    const std::vector<Line>& lines = content.lines;
    const bool may_be_unfinished = newest && head_;  // Programs write a head before their first line.
    std::size_t end = lines.size();
    while (may_be_unfinished && end > 0 && !lines[end - 1].link) --end;
    bool has_header = false;
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto& [text, link, unfinished] = lines[i];
      if (unfinished || i >= end) {
        note_unfinished(file, i + 1);
      } else if (!link) {
        broken(file, i + 1, "is no line of an audit trail");
      } else {
        if (link->event == kResumedEvent && (i == 0 || !lines[i - 1].unfinished))
          broken(file, i + 1, "names an unfinished line before it, which is not there as it was");
        if (link->event == kFileEvent && link->file == number) has_header = true;
        // Rotation takes whole files away.
        if ((!has_header && link->event != kResumedEvent) || (number == 1 && check_.lines.empty() && link->number != 1))
          broken(file, i + 1, "is not the first line of its file: lines before it were removed");
        check_line(file, i + 1, text, *link);
      }
    }
    if (content.rest.empty()) return;
    const std::size_t line = lines.size() + 1;
    if (may_be_unfinished) return note_unfinished(file, line);
    broken(file, line,
           newest ? "is no line of an audit trail" : "ends in the middle of a line, although another file follows");
  }

  void note_unfinished(const std::string& file, std::size_t line) {
    check_.notes.push_back(fmt::format(
        "{}:{}: unfinished: the program was killed, the disk was full, or it is being written", file, line));
  }

  void check_line(const std::string& file, std::size_t at, const std::string& line, const Link& link) {
    if (link.number == 1 && !before_ && link.before != hash_before_all())
      broken(file, at, "names a line before the first");
    if (before_ && link.number != before_->number + 1)
      broken(file, at, fmt::format("has number {} after {}", link.number, before_->number));
    if (before_ && link.before != before_->hash)
      broken(file, at, "does not name the hash of the line before: one of the two was changed");
    if (check_.lines.empty()) first_number_ = link.number;
    if (link.event == kFileEvent) oldest_ = link.oldest;
    if (link.event == kMissingEvent)
      broken(file, at, "lines before it were removed or changed while no program wrote here");
    check_.lines.push_back(line);
    before_ = check_.last = {link.number, sha256(line)};
    if (head_ && head_->number == link.number && head_->hash != check_.last.hash)
      broken(file, at, "is not the line that was written: its hash is another in " + head_file_of(folder_));
  }

  /// Rotation removes the oldest files, and says so in the first line of the newest.
  void check_begin(std::uint64_t oldest_there) {
    if (oldest_there > oldest_)
      return broken(file_of(folder_, oldest_there - 1), 0, "is missing, and was not removed by rotation");
    if (first_number_ > 1)
      check_.notes.push_back(fmt::format("begins with line {}: older files were removed by rotation", first_number_));
  }

  void check_end() {
    const std::string head = head_file_of(folder_);
    if (!head_ && check_.last.number > 0) return broken(head, 0, "is missing, or not as it was written");
    if (head_ && head_->number > check_.last.number)
      broken(head, 0,
             fmt::format("lines {} to {} were written, and are not there", check_.last.number + 1, head_->number));
  }

  std::string folder_;
  std::optional<Head> head_;
  Check check_;
  std::optional<Head> before_;  // the line before the next one, as far as it is known
  std::string broken_file_;     // the newest
  std::uint64_t oldest_ = 1, first_number_ = 0;
};

}  // namespace

Check check_trail(const std::string& folder) {
  return Checker(folder).run();
}

std::string readable(const std::string& line) {
  const auto json = nlohmann::ordered_json::parse(line);
  const auto utc = json.find("utc");
  std::string text = utc != json.end() && utc->is_string() ? utc->get<std::string>() : "?";
  text += " " + json.at("event").get<std::string>();
  const char* between = ": ";
  for (const auto& [key, value] : json.items()) {
    if (key == "n" || key == "utc" || key == "mono_s" || key == "event" || key == "before") continue;
    text += between + key + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
    between = ", ";
  }
  return printable(text);
}

namespace {

struct Options {
  std::string folder;
  bool json = false, quiet = false;
};

int run(const Options& o) {
  if (o.json && o.quiet) cli::refuse_option("--json", "", "does not go with --quiet, which prints no lines");
  const Check check = check_trail(o.folder);
  if (check.files == 0 && !read_head(o.folder)) throw InputError(o.folder + ": no audit trail is there");
  if (o.json) {
    cli::OutputFile out("standard output", "-");
    for (const std::string& line : check.lines) out.stream() << line << '\n';
    out.commit();
  } else if (!o.quiet) {
    for (const std::string& line : check.lines) std::cout << readable(line) << '\n';
  }
  std::cout << std::flush;
  if (!std::cout) throw InputError("standard output: cannot be written");
  for (const std::string& note : check.notes) std::cerr << "knuckle audit: " << note << '\n';
  for (const std::string& broken : check.breaks) std::cerr << "knuckle audit: BROKEN: " << broken << '\n';
  if (!check.breaks.empty()) return 1;
  if (check.lines.empty()) {
    std::cerr << "knuckle audit: whole, and empty: no line has been written\n";
    return 0;
  }
  std::cerr << fmt::format(
      "knuckle audit: whole: {} lines in {} files; the last is {} with hash {}: keep a note of it "
      "elsewhere\n",
      check.lines.size(), check.files, check.last.number, check.last.hash);
  return 0;
}

}  // namespace

cli::Command audit_entry() {
  return {"audit", "Print an audit trail of the machine's side, and check that nobody has changed it",
          [](const cli::OptionList& command) {
            const auto options = std::make_shared<Options>();
            command.add_option("FOLDER", options->folder, "Of the trail (knuckle slave --audit)").required();
            command.add_flag("--json", options->json, "Print the lines as they are in the files");
            command.add_flag("--quiet", options->quiet, "Print the result only");
            return [options] { return run(*options); };
          }};
}

}  // namespace knuckle::audit
