// Gives the headers that tests of the machine share a target; it needs a source.
