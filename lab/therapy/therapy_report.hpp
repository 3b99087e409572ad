// Report of one session of a person, and of the progress over all sessions.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "lab/report/html_report.hpp"
#include "lab/therapy/person_store.hpp"

namespace tandem::lab {

/// Disclaimer that each report and --help contain.
inline constexpr std::string_view kNotMedicalDevice =
    "Not a medical device: the measures are for training and research, not for diagnosis or treatment.";

/// Returns the report of one session.
/// In      sessions  all sessions of the person, sorted by number
///         index  index in `sessions` of the reported session
HtmlReport therapy_report(std::string_view pseudonym, std::span<const StoredSession> sessions, std::size_t index);

/// Returns the measures of all sessions as CSV, one measure per line: session, date, kind, name, measure, unit, value.
/// The first line after the header is kNotMedicalDevice. A text that a spreadsheet would evaluate as a formula begins
/// with an apostrophe.
std::string measures_csv(std::span<const StoredSession> sessions);

/// Returns the movements of one session as CSV, one movement per line, in the format of read_csv().
std::string movements_csv(const SessionMeasures& session);

}  // namespace tandem::lab
