#include "client/signals/signal_line.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <vector>

#include "proto/signals.hpp"

namespace tandem::client {
namespace {

std::vector<std::string> words_of(const std::string& line) {
  constexpr const char* kBlanks = " \t\r";
  std::vector<std::string> words;
  for (std::size_t begin = line.find_first_not_of(kBlanks); begin != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(kBlanks, end);
  }
  return words;
}

double number_of(const std::string& word, const char* what) {
  double number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc{} || end != word.data() + word.size()) {
    throw std::invalid_argument(std::string("the ") + what + " '" + printable(word) + "' is not a number");
  }
  return number;
}

}  // namespace

SignalLine parse_signal_line(const std::string& line) {
  const std::vector<std::string> words = words_of(line);
  if (words.size() < 2 || words.size() > 4) {
    throw std::invalid_argument("a line has " + std::to_string(words.size()) +
                                " words; it must be: name value [confidence [age in seconds]]");
  }
  SignalLine out;
  out.signal.name = words[0];
  out.signal.value = number_of(words[1], "value");
  if (words.size() > 2) out.signal.confidence = number_of(words[2], "confidence");
  const double age_s = words.size() > 3 ? number_of(words[3], "age") : 0;
  if (!proto::is_signal_age(age_s)) {
    throw std::invalid_argument("the age " + words[3] + " must be 0 to 600 s");
  }
  out.age = from_seconds(age_s);
  if (const std::string problem = problem_of(out.signal); !problem.empty()) throw std::invalid_argument(problem);
  return out;
}

}  // namespace tandem::client
