"""One joint's drive train from its motor and link readings.

train_fit         parameters of a given form: residuals, cost, Levenberg-Marquardt
steady_contact    where a mesh lies on one side for sure: gap, compliance and friction without its crossings
mesh_friction     where the search for friction in the mesh begins
quantities        what is reported: values, standard deviations, what was not excited
identification    the form that holds, its parameters, and how sure its side is
"""
