"""Commands about many robots: datasets, studies, frozen tasks."""
