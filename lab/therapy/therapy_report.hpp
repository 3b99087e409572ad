// Report of one session of a person, and of the progress over all sessions.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "lab/report/html_report.hpp"
#include "lab/therapy/person_store.hpp"

namespace tandem::lab {

/// Stands on each report and in --help.
inline constexpr std::string_view kNotMedicalDevice =
    "Not a medical device: the measures are for training and research, not for diagnosis or treatment.";

/// In      sessions  all sessions of the person, by number
///         index  session of the report
HtmlReport therapy_report(std::string_view pseudonym, std::span<const StoredSession> sessions, std::size_t index);

/// Measures of all sessions, one a line: session, date, kind, name, measure, unit, value. The first line after the header
/// has kNotMedicalDevice. A text that a spreadsheet would evaluate begins with an apostrophe.
std::string measures_csv(std::span<const StoredSession> sessions);

/// Movements of one session, one a line, in the format of read_csv().
std::string movements_csv(const SessionMeasures& session);

}  // namespace tandem::lab
