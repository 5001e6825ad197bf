% What Octave reads in an exported recording, for tests to compare with the recording: lines as of hdf5_witness.py,
% without units. Arguments: HDF5 file, CSV of the machine's side, output.
function octave_witness(hdf5, csv, out)
  data = load(hdf5);
  file = fopen(out, "w");
  for group = {"machine", "operator"}
    fields = data.(group{1});
    for name = fieldnames(fields)'
      fprintf(file, "%s/%s\t", group{1}, name{1});
      fprintf(file, "\t%.17g", double(fields.(name{1})(:)));
      fprintf(file, "\n");
    end
  end
  % The table's columns, words as NaN.
  lines = strsplit(strtrim(fileread(csv)), "\n");
  names = strsplit(lines{1}, ",");
  cells = cellfun(@(line) strsplit(line, ","), lines(2:end), "UniformOutput", false);
  numbers = str2double(vertcat(cells{:}));
  for column = 1:numel(names)
    fprintf(file, "csv/%s\t", names{column});
    fprintf(file, "\t%.17g", numbers(:, column));
    fprintf(file, "\n");
  end
  fclose(file);
end
