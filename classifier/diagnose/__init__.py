"""Diagnosis of measured records, turn by turn.

attribution  which frequencies spoke for a class: integrated gradients
diagnosis    the record of one turn -> class, outputs, what the model's parts say, bands
incremental  samples as they come -> a report at every turn
signals      files, patterns, folders and data sets -> signals with what is known of them
report       reports in words, as JSON and as one table
__main__     the command                                       (indexer diagnose)
"""

from classifier.diagnose.diagnosis import Diagnosis, diagnose_turn
from classifier.diagnose.incremental import IncrementalDiagnoser, TurnReport, diagnose

__all__ = ["Diagnosis", "IncrementalDiagnoser", "TurnReport", "diagnose", "diagnose_turn"]
