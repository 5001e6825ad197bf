// Questions at a terminal whose answer is one of a few words, asked while the machine's loop runs and nothing moves. A
// person who gives any other answer is asked again; a script's commissioning ends: a word that is there by mistake must
// never move a machine.
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/background_writer.h"
#include "core/time.h"

namespace knuckle::bringup {

/// Why commissioning ended before its end. The machine is neutral when it is caught.
class CommissionEnded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Lines typed by a person or a script, without waiting for them.
class LineInput {
 public:
  explicit LineInput(int descriptor) noexcept : descriptor_(descriptor) {}
  /// The next whole line, if there is one by now. @throws CommissionEnded where the input has ended.
  [[nodiscard]] std::optional<std::string> poll();

 private:
  int descriptor_;
  std::string pending_;
  bool ended_ = false;
};

/// What is asked: the answer is one of the choices, or a number within the bounds.
struct Question {
  std::string text;
  std::vector<std::string> choices;
  std::optional<std::pair<double, double>> bounds;
  std::string unit;  ///< Of the number: "mm", "degrees".
};
/// In one line: "text [word | word]", "text, in mm: [10 to 20]".
[[nodiscard]] std::string text(const Question& question);

/// Who answers: a terminal, a script, or the buttons of a screen.
struct Partner {
  std::function<void(const std::string& line)> say;
  std::function<void(int number, const std::string& title)> begin;  ///< A step begins.
  std::function<void(const Question&)> ask;
  std::function<std::optional<std::string>()> poll;  ///< The next answer, if there is one by now.
  /// A person types as it goes: what was typed before a question is no answer to it, and anything typed while
  /// something moves means stop. A script's lines are all there from the beginning.
  bool live = false;
  std::string stop_gesture = "pressing Enter";  ///< By which a person ends it while something moves.
};
/// Before anything is asked: a reader that works takes the first lines sooner.
inline constexpr Duration kToldPatience = 1s;
/// @param patience for what was said so far to be written.
/// @throws InputError where it cannot be: nobody would know what is asked, or what moves.
void check_told(const cli::BackgroundWriter& said, Duration patience = Duration::zero());
/// Lines of text. @param poll as LineInput::poll(). @param out outlives what is returned.
[[nodiscard]] Partner terminal(std::ostream& out, std::function<std::optional<std::string>()> poll, bool live);

class Dialogue {
 public:
  /// @param idle lets the machine go on for a moment; called until there is an answer.
  Dialogue(Partner partner, std::function<void()> idle) : partner_(std::move(partner)), idle_(std::move(idle)) {}

  void say(const std::string& line) { partner_.say(line); }
  /// A step of the commissioning begins.
  void begin(int number, const std::string& title) { partner_.begin(number, title); }
  /// @return which of the choices. @throws CommissionEnded for any other answer of a script.
  int ask(const std::string& question, std::initializer_list<const char*> choices);
  /// @throws CommissionEnded for any other answer of a script than a number within the bounds.
  /// @param known where the answer is known without asking (on a simulated machine), the word "tape" takes it.
  double ask_number(const std::string& question, double low, double high, const std::string& unit,
                    std::optional<double> known = {});
  /// Whether a person typed anything: while something moves, that means stop.
  [[nodiscard]] bool interrupted();
  [[nodiscard]] const std::string& stop_gesture() const noexcept { return partner_.stop_gesture; }

 private:
  std::string answer(const Question& question);
  void refuse(const std::string& why);

  Partner partner_;
  std::function<void()> idle_;
};

}  // namespace knuckle::bringup
