"""What a robot of the series has that the datasheet has not; one file a class of defect."""
